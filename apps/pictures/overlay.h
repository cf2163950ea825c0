#pragma once

#include <optional>
#include <string>
#include <vector>

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

/// What an overlay of several objects shows. All images have the same size.
struct ObjectsInput {
    std::string view;
    const Image& xray;
    const Image& weights;                   ///< as in OverlayInput
    const std::vector<std::string>& names;  ///< of the objects
    const std::vector<Image>& drrs_start;   ///< one per object
    const std::vector<Image>& drrs_result;  ///< one per object
    const Image& drr_sum;                   ///< of the results
};

/// Four panels as overlay_picture has them; the contours of every object's DRR in a colour of its own over the X-ray,
/// before and after, and the names of the objects in these colours below. After eight objects colours repeat.
[[nodiscard]] RgbImage objects_picture(const ObjectsInput& input);

}  // namespace raylign::detail::apps
