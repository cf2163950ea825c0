#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/io/images/png.h"
#include "raylign/image.h"
#include "raylign/io/image.h"

namespace raylign::detail::apps {

using Colour = std::array<std::uint8_t, 3>;

/// Grey values: `low` is shown black, `high` white.
struct Window {
    double low = 0, high = 1;
};

/// The 1st to 99th percentile of the pixels of positive weight (empty weights: all): a few hot pixels or letters do not
/// spoil the contrast. Never empty: high > low.
[[nodiscard]] Window robust_window(const Image& image, const Image& weights);

/// Value through the window, in [0, 1].
[[nodiscard]] double through_window(double value, const Window& window);

/// Cubic interpolation at `factor` >= 1 places per pixel and axis; pixel edges stay where they are:
/// x' = factor (x + 1/2) - 1/2. Borders are repeated. Smooth, so that contours do not snap to pixels; overshoots a
/// little.
[[nodiscard]] Image enlarged(const Image& image, int factor);

/// Gaussian smoothing, borders repeated; sigma in (0, 32] px.
[[nodiscard]] Image smoothed(const Image& image, double sigma_px);

/// 2x2 means, repeated until neither side is longer than `longest_px`.
[[nodiscard]] Image shrunk_to(const Image& image, int longest_px);

[[nodiscard]] RgbImage blank(int width, int height, Colour colour);
/// Grey picture, larger values brighter: bone bright for line integrals.
[[nodiscard]] RgbImage grey_picture(const Image& image, const Window& window);

/// Copies `tile` into `picture` with its top left corner at (x, y); what sticks out is dropped.
void paste(RgbImage& picture, const RgbImage& tile, int x, int y);
void fill(RgbImage& picture, int x, int y, int width, int height, Colour colour);
void draw_text(RgbImage& picture, std::string_view text, int x, int y, int scale, Colour colour);

}  // namespace raylign::detail::apps
