#pragma once

#include <string>
#include <vector>

namespace raylign::detail::apps {

/// `geometry --check`: what the report.json files in these folders, or in the folders right inside of them, say of the
/// cameras, view by view: the mean correction and its spread over cases. A rig's error is the same in all of them.
/// Returns the text, or JSON. Throws Error where a folder holds no report, and for a report that is no `register`'s.
[[nodiscard]] std::string rig_check(const std::vector<std::string>& folders, bool as_json);

}  // namespace raylign::detail::apps
