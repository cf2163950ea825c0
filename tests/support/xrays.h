#pragma once

#include <utility>

#include "raylign/intensity.h"
#include "raylign/view.h"
#include "raylign/xray.h"

namespace raylign::detail::test {

/// Counts of a model's detector become the view's image and weights, as a user's files of a C-arm are read.
inline void take_counts(View& view, const RawXray& counts) {
    IntensitySettings settings;
    settings.kind = IntensityKind::transmission;
    settings.polarity = Polarity::bone_dark;
    settings.auto_mask = true;
    XrayConversion read = line_integral_from_xray(counts, {}, settings, "view " + view.name);
    view.image = std::move(read.line_integral);
    view.weights = std::move(read.weights);
}

}  // namespace raylign::detail::test
