#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace raylign::detail {

using LabelNames = std::map<std::int32_t, std::string>;

/// Of a NIfTI file's extension, as TotalSegmentator and Connectome Workbench write it:
/// <Label Key="1" ...><![CDATA[spleen]]></Label>.
[[nodiscard]] LabelNames label_names_in_xml(std::string_view text);

/// Of a table: CSV "number,name" (or with blanks or tabs), a colour table of 3D Slicer (.ctbl, .txt), or the label
/// descriptions of ITK-SNAP. Throws Error for a file without labels, and for a number with two names.
[[nodiscard]] LabelNames read_label_names(const std::filesystem::path& path);

/// The labels of TotalSegmentator's task `total`, version 2.
[[nodiscard]] LabelNames total_segmentator_names();

/// The number of `name`, compared without regard to case. Throws Error with the nearest name where there is none;
/// `source` says in whose names it was looked for.
[[nodiscard]] std::int32_t label_of(const LabelNames& names, std::string_view name, std::string_view source);

}  // namespace raylign::detail
