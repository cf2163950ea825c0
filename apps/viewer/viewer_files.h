#pragma once

#include <string_view>

namespace raylign::detail::apps {

/// The parts of the viewer's page, embedded by CMake.
std::string_view viewer_style();
std::string_view viewer_script();  ///< bundled from page/; empty where that could not be done when building

}  // namespace raylign::detail::apps
