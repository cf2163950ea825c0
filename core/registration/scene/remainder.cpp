#include "core/registration/scene/remainder.h"

#include <algorithm>

#include "core/image/pyramid.h"

namespace raylign::detail {
namespace {

/// What the others show of a view, times the gain; empty where there are none.
Image others_of(const Shown& shown, std::size_t view, std::optional<std::size_t> kept) {
    Image sum;
    const auto gain = static_cast<float>(shown.gains[view]);
    for (std::size_t k = 0; k < shown.drrs.size(); ++k) {
        if (k == kept) continue;
        const Image& drr = shown.drrs[k][view];
        if (sum.empty()) sum = Image(drr.width, drr.height);
        std::ranges::transform(sum.pixels, drr.pixels, sum.pixels.begin(),
                               [gain](float s, float d) { return s + gain * d; });
    }
    return sum;
}

/// A last odd row or column, which halving drops, goes with its neighbour.
void subtract(Image& image, const Image& coarse, int halvings) {
    for (int y = 0; y < image.height; ++y) {
        const float* row = coarse.pixels.data() + coarse.index(0, std::min(y >> halvings, coarse.height - 1));
        float* pixels = &image(0, y);
        for (int x = 0; x < image.width; ++x) pixels[x] -= row[std::min(x >> halvings, coarse.width - 1)];
    }
}

}  // namespace

std::vector<Image> drawn(ResidentVolume& volume, const RigidTransform& world_from_ct, std::span<const View> views,
                         const Fineness& fineness) {
    std::vector<View> bare;
    for (std::size_t v = 0; v < views.size(); ++v) {
        View empty{views[v].name, views[v].geometry, {}, {}};
        empty.ceiling = views[v].ceiling;
        bare.push_back(halved(empty, fineness.image_halvings[v]));
    }
    const auto session = volume.session(fineness.volume_halvings, bare, {});
    std::vector<Image> drrs;
    for (std::size_t v = 0; v < bare.size(); ++v) drrs.push_back(session->render(world_from_ct, v));
    return drrs;
}

std::vector<View> remainder(std::span<const View> views, const Shown& shown, std::optional<std::size_t> kept) {
    std::vector<View> left(views.begin(), views.end());
    for (std::size_t v = 0; v < left.size(); ++v) {
        const Image others = others_of(shown, v, kept);
        if (!others.empty()) subtract(left[v].image, others, shown.halvings.empty() ? 0 : shown.halvings[v]);
    }
    return left;
}

}  // namespace raylign::detail
