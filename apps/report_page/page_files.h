#pragma once

#include <string_view>

namespace raylign::detail::apps {

/// The parts of a report page, embedded by CMake from the files beside this one.
std::string_view page_html();
std::string_view page_style();
std::string_view page_script();
std::string_view page_charts();  ///< the chart library; empty where it could not be had when building
std::string_view paper_2006();   ///< what the paper reports, JSON

}  // namespace raylign::detail::apps
