#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace raylign::detail::apps {

/// A page with its marks (@TITLE@, ...) replaced, each once, in this order: what is filled in last may hold marks.
[[nodiscard]] std::string filled(std::string page,
                                 const std::vector<std::pair<std::string_view, std::string_view>>& texts);

/// JSON for inside <script>: a "</script>" in a file's name must not end it. "\u003c" is the same text to JSON.
[[nodiscard]] std::string safe_in_script(std::string_view json);

}  // namespace raylign::detail::apps
