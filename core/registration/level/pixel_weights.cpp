#include "core/registration/level/pixel_weights.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/image/gradient_filter.h"
#include "core/image/smooth.h"
#include "core/similarity/robust_weights.h"

namespace raylign::detail {
namespace {

constexpr float kFloorShare = 0.05F;  // of the mean energy: empty background must not become the loudest part

}  // namespace

std::vector<Image> neighbourhood(Session& session, const RigidTransform& world_from_ct, int margin_px) {
    std::vector<Image> domain;
    for (std::size_t v = 0; v < session.view_count(); ++v) {
        Image outside = session.render(world_from_ct, v);
        for (float& pixel : outside.pixels) pixel = pixel > 0 ? 0.F : 1.F;
        if (margin_px > 0) outside = erode_weights(outside, margin_px);
        for (float& pixel : outside.pixels) pixel = 1 - pixel;
        domain.push_back(std::move(outside));
    }
    return domain;
}

std::vector<Image> local_normalisation(const Session& session, double sigma_px) {
    std::vector<Image> weights;
    for (std::size_t v = 0; v < session.view_count(); ++v) {
        const FixedChannels& fixed = session.fixed_channels(v);
        Image energy(fixed.weights.width, fixed.weights.height);
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < energy.pixels.size(); ++i) {
            if (fixed.weights.pixels[i] == 0) continue;
            for (const Image& channel : fixed.channels) energy.pixels[i] += channel.pixels[i] * channel.pixels[i];
            sum += energy.pixels[i];
            ++count;
        }
        const auto mean = static_cast<float>(sum / count);
        Image local = smoothed(energy, std::clamp(sigma_px, 1.0, 1000.0));
        for (float& pixel : local.pixels) pixel = mean / (pixel + kFloorShare * mean);
        weights.push_back(std::move(local));
    }
    return weights;
}

bool leaves_enough(const Session& session, const std::vector<Image>& weights) {
    for (std::size_t v = 0; v < weights.size(); ++v) {
        const std::vector<float>& mask = session.fixed_channels(v).weights.pixels;
        int left = 0;
        for (std::size_t i = 0; i < mask.size(); ++i) left += weights[v].pixels[i] * mask[i] > 0;
        if (left < kMinPixels) return false;
    }
    return true;
}

void multiply(std::vector<Image>& a, const std::vector<Image>& b) {
    if (a.size() != b.size()) throw Error("multiply: different numbers of images");
    for (std::size_t v = 0; v < a.size(); ++v) {
        if (a[v].pixels.size() != b[v].pixels.size()) throw Error("multiply: images of different sizes");
        std::ranges::transform(a[v].pixels, b[v].pixels, a[v].pixels.begin(), [](float x, float y) { return x * y; });
    }
}

PixelWeights::PixelWeights(Session& session, const std::vector<Image>& base) : session_(session) {
    if (!base.empty()) session.set_weights(base);
    for (std::size_t v = 0; v < session.view_count(); ++v) unweighted_.push_back(session.fixed_channels(v));
}

void PixelWeights::reweight(const RigidTransform& world_from_ct) {
    std::vector<Image> base;
    robust_.clear();
    for (std::size_t v = 0; v < unweighted_.size(); ++v) {
        robust_.push_back(robust_weights(unweighted_[v], session_.moving_channels(world_from_ct, v)));
        base.push_back(unweighted_[v].weights);
    }
    multiply(base, robust_);
    session_.set_weights(base);
}

}  // namespace raylign::detail
