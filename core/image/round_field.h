#pragma once

#include <optional>

#include "core/image/convex_hull.h"
#include "raylign/image.h"

namespace raylign::detail {

/// The edge of a round field of view that no threshold shows: outside lies scattered light, and a body within the field
/// can be as dark. The field is brighter within its edge wherever its content lets the eye see that, and nowhere
/// darker. For circles about the image's middle (within 6 % of the shorter side; radius 0.38 to 0.72 of it) the step
/// of the logarithm across the circle, less the mean of the steps 6 pixels within and without if that is one down, too,
/// is counted along 90 rays, each at most as much as three sigma of the noise. The best circle is one where at least a
/// fifth of its round lies in the image and the counted steps there are 0.55 of the most. Empty where there is none,
/// and in images of less than 64 pixels a side. NaN is left out.
[[nodiscard]] std::optional<Circle> round_field_by_its_step(const Image& intensities);

}  // namespace raylign::detail
