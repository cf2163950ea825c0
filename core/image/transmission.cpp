#include "core/image/transmission.h"

#include <algorithm>
#include <cmath>

namespace raylign::detail {
namespace {

constexpr double kBrightest = -5;  // 150 times the open beam: no X-ray, but no infinity either

}  // namespace

View shown_as_transmission(View view) {
    view.by_transmission = false;
    if (view.ceiling <= kCeiling_transmission) return view;
    const double floor = std::exp(-view.ceiling);
    const double veil = (std::exp(-kCeiling_transmission) - floor) / (1 - floor);
    view.ceiling = kCeiling_transmission;
    for (float& pixel : view.image.pixels) {
        // Pixels without a use may be NaN, and stay so.
        const double integral = pixel < kBrightest ? kBrightest : double{pixel};
        pixel = static_cast<float>(-std::log(veil + (1 - veil) * std::exp(-integral)));
    }
    return view;
}

std::vector<View> as_compared(std::span<const View> views) {
    std::vector<View> result(views.begin(), views.end());
    for (View& view : result) {
        if (view.by_transmission) view = shown_as_transmission(std::move(view));
    }
    return result;
}

}  // namespace raylign::detail
