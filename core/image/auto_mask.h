#pragma once

#include <string>
#include <vector>

#include "raylign/image.h"

namespace raylign::detail {

/// Weights 0 where pixels say nothing of the body, 1 elsewhere, and in words what was found. Empty weights: nothing.
/// All four functions take intensities (more X-rays = larger); pixels of weight 0 are left out of the judgement.
struct AutoMask {
    Image weights;
    std::vector<std::string> decisions;
};

/// The field of a round or polygonal collimator (up to 8 sides, any place): the dark rest of the image touches its
/// border and the bright part is one piece whose convex hull it fills along at least 3/4 of the edge, and the hull is
/// a circle or such a polygon. Leaves out what is outside and 2 px within. Dark bodies in air do not pass: the air
/// around them is no convex field. Circles below `least_radius_share` of the shorter side are balls and heads.
[[nodiscard]] AutoMask mask_frame(const Image& intensities, const Image& weights, double least_radius_share = 0.3);

/// A round field about the image's middle whose surroundings are as bright as what the body leaves within it, so that
/// no threshold tells them apart: by the step across its edge (round_field.h).
[[nodiscard]] AutoMask mask_stepped_field(const Image& intensities, const Image& weights);

/// Letters, burnt-in text, lead markers and beads: small pieces (up to 1/20 of the image's side) that stand out from
/// the median around them (1/16 of the side) by more than a quarter of the image's range or a factor of 2.5, and 2 px
/// around them; what surrounds them with half that contrast must be as small. Bones and skin are larger.
[[nodiscard]] AutoMask mask_marks(const Image& intensities, const Image& weights);

/// Saturated pixels (at `max_representable`, or a plateau of 0.5 % of the pixels at the image's largest value where
/// that is 0) and pixels of 0 or below, and 1 px around them.
[[nodiscard]] AutoMask mask_clipped(const Image& intensities, double max_representable);

}  // namespace raylign::detail
