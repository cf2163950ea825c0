#pragma once

#include <string>
#include <string_view>

namespace raylign::detail::apps {

/// What goes into page.html, the frame of all pages.
struct PageParts {
    std::string_view title, style;
    std::string_view main;  ///< id of <main>, by which the script knows the page
    std::string_view data;  ///< JSON
    std::string libraries;  ///< scripts before the page's own
    std::string_view script;
};

/// A self-contained page. A "</script>" in the data does not end it.
[[nodiscard]] std::string framed(const PageParts& parts);

}  // namespace raylign::detail::apps
