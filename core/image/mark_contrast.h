#pragma once

#include <vector>

#include "raylign/image.h"

namespace raylign::detail {

inline constexpr double kOutlineContrast = 0.5;  ///< of a mark's contrast: what it is outlined by

/// How much each pixel stands out from the median of the 9 x 9 samples within `window` pixels around it, as letters and
/// markers of lead do; 1 = enough for a mark: a quarter of the image's `range`, or 2.5 times as dark or bright. 0 for
/// what stands out less than kOutlineContrast and is seen to without a median: those take nearly all the time. Pixels
/// that are not finite have 0 and do not count.
[[nodiscard]] std::vector<double> mark_contrast(const Image& image, double range, int window);

}  // namespace raylign::detail
