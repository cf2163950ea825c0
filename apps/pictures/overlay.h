#pragma once

#include <optional>
#include <string>

#include "core/io/images/png.h"
#include "raylign/image.h"
#include "raylign/io/image.h"

namespace raylign::detail::apps {

/// What one overlay shows. All images have the same size; line integrals, denser = larger.
struct OverlayInput {
    std::string view;
    const Image& xray;
    const Image& weights;  ///< 0 = ignored pixel, dimmed in the picture; empty = none
    const Image& drr_start;
    const Image& drr_result;
    std::optional<double> px_per_mm;  ///< at the object's depth, for the scale bar; empty = no bar
};

/// Four labelled panels, bone bright: the X-ray, the DRR at the result, and the contours of both images over the X-ray
/// before and after. Orange = DRR, blue = X-ray, white = both: double lines are a misalignment. Each panel is at least
/// 512 px a side.
[[nodiscard]] RgbImage overlay_picture(const OverlayInput& input);

}  // namespace raylign::detail::apps
