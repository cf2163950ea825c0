#pragma once

namespace raylign::detail::apps {

inline constexpr int kGlyphWidth = 5, kGlyphHeight = 7, kGlyphAdvance = 6;

/// True where the glyph of `letter` has ink. Capitals, digits and some signs; lower case is drawn as capitals,
/// everything else as a filled box.
[[nodiscard]] bool glyph_bit(char letter, int column, int row);

}  // namespace raylign::detail::apps
