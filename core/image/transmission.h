#pragma once

#include <span>
#include <vector>

#include "raylign/view.h"

namespace raylign::detail {

/// Line integral at which a detector is taken to saturate where views are compared by what arrives: what is shown of
/// the beam is then its share that arrives, but for a bend of half of this.
inline constexpr double kCeiling_transmission = 0.1;

/// The view with A' = -log(g + (1 - g) exp(-A)) in place of its image A and C = kCeiling_transmission in place of its
/// ceiling c, g = (exp(-C) - f) / (1 - f) with f = exp(-c): an image A = -log(f + (1 - f) exp(-I)) becomes what a DRR
/// shows of I under the new ceiling, so that both are compared as before, but nearly by exp(-I). A ceiling below C
/// stays. Line integrals below -5 count as -5.
[[nodiscard]] View shown_as_transmission(View view);

/// The views as they are compared: by transmission where they ask for it (View::by_transmission), which they then no
/// longer do.
[[nodiscard]] std::vector<View> as_compared(std::span<const View> views);

}  // namespace raylign::detail
