#pragma once

#include <optional>
#include <span>
#include <vector>

#include "raylign/image.h"
#include "raylign/view.h"

namespace raylign::detail {

/// What the objects of a scene show at their poses in the views as given.
struct Shown {
    std::vector<std::vector<Image>> drrs;  ///< per object and view
    std::vector<double> gains;             ///< per view, by which the sum of them fits the X-ray best
};

/// The views less what all objects but `kept` show, times the gain; nothing kept: less what all show.
[[nodiscard]] std::vector<View> remainder(std::span<const View> views, const Shown& shown,
                                          std::optional<std::size_t> kept);

}  // namespace raylign::detail
