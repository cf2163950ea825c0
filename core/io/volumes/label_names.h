#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace raylign::detail {

using LabelNames = std::map<std::int32_t, std::string>;

/// Of a NIfTI file's extension, as TotalSegmentator and Connectome Workbench write it:
/// <Label Key="1" ...><![CDATA[spleen]]></Label>.
[[nodiscard]] LabelNames label_names_in_xml(std::string_view text);

}  // namespace raylign::detail
