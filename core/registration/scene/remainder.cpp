#include "core/registration/scene/remainder.h"

#include <algorithm>
#include <functional>

namespace raylign::detail {
namespace {

/// What the others show of a view, times the gain.
Image others_of(const Shown& shown, std::size_t view, std::optional<std::size_t> kept, const Image& like) {
    Image sum(like.width, like.height);
    const auto gain = static_cast<float>(shown.gains[view]);
    for (std::size_t k = 0; k < shown.drrs.size(); ++k) {
        if (k == kept) continue;
        std::ranges::transform(sum.pixels, shown.drrs[k][view].pixels, sum.pixels.begin(),
                               [gain](float s, float d) { return s + gain * d; });
    }
    return sum;
}

}  // namespace

std::vector<View> remainder(std::span<const View> views, const Shown& shown, std::optional<std::size_t> kept) {
    std::vector<View> left(views.begin(), views.end());
    for (std::size_t v = 0; v < left.size(); ++v) {
        const Image others = others_of(shown, v, kept, left[v].image);
        std::ranges::transform(left[v].image.pixels, others.pixels, left[v].image.pixels.begin(), std::minus<>());
    }
    return left;
}

}  // namespace raylign::detail
