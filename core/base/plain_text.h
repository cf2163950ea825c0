#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace raylign::detail {

/// Text of a file or a file's name on one line, as a terminal may show it: control characters and bytes that are no
/// UTF-8 become \n, \t or \x1b. Beyond `most` bytes the middle is left out, and their number stands in its place.
[[nodiscard]] std::string plain_text(std::string_view text, std::size_t most = 400);

/// The same of text of several lines: line feeds stay. What follows one within a message is expected to begin with
/// blanks, as our lists do: elsewhere it was part of a name and becomes \n.
[[nodiscard]] std::string plain_message(std::string_view text, std::size_t most = 4000);

/// The same of a whole page for a terminal: line feeds stay, nothing is cut.
[[nodiscard]] std::string plain_page(std::string_view text);

}  // namespace raylign::detail
