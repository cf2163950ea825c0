#pragma once

#include <string_view>
#include <vector>

namespace raylign::detail::apps {

struct Topic {
    std::string_view name;
    std::string_view text;  ///< lines of at most 100 columns
};

/// The first sections of the manual's pages, in the order in which they are read; topics.cmake takes them from docs/.
[[nodiscard]] std::vector<Topic> topics();

}  // namespace raylign::detail::apps
