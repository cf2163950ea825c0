#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/report_page/report_page.h"

namespace raylign::detail::apps {

/// A part of a page that another room draws: its script, and members of the page's data, JSON texts by name.
struct PageScript {
    std::string_view script;
    std::vector<std::pair<std::string, std::string>> data;
};

/// report_page with such a part.
[[nodiscard]] std::string report_page(std::string_view kind, std::string_view report,
                                      const std::vector<PageOverlay>& overlays,
                                      const std::vector<std::pair<std::string, std::string>>& more,
                                      const PageScript& part);

}  // namespace raylign::detail::apps
