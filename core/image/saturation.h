#pragma once

#include <optional>

#include "raylign/image.h"

namespace raylign::detail {

/// Where a detector saturates.
struct Saturation {
    double ceiling = 0;  ///< of the line integrals
    double share = 0;    ///< of the usable pixels that are flat and that dense
};

/// From the flat densest region, as metal that lets nothing through shows it: usable pixels whose 7 x 7 neighbourhood
/// differs by less than 5 % of the image's range (its 2nd to 98th percentile) and that are denser than half way from
/// the median to the 98th percentile; their upper quartile (crests of bone are flat, too). Pixels of the largest value
/// that hang together with the image's edge (no counts: a collimator) do not count. None where fewer than 0.3 % of the
/// usable pixels are so. `line_integral`: denser = larger. `weights`: 0 = not usable; empty = all are.
[[nodiscard]] std::optional<Saturation> find_saturation(const Image& line_integral, const Image& weights);

}  // namespace raylign::detail
