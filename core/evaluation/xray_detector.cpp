#include <algorithm>
#include <cmath>

#include "core/evaluation/poisson.h"
#include "core/evaluation/xray_parts.h"

namespace raylign {
using namespace detail;
namespace {

/// Photons of many energies, as one scaled Poisson number: with n photons in the open beam, energy m and sum of squares
/// s, the number n m^2 / s times s / (m n) has the mean m and the variance s / n, as the sum over energies has.
Image with_quantum_noise(const XrayExposure& exposure, Random& random) {
    Image noisy = exposure.energy;
    if (exposure.photons_per_sample == 0) return noisy;
    for (std::size_t i = 0; i < noisy.pixels.size(); ++i) {
        const double mean = exposure.energy.pixels[i], squared = exposure.energy_squared.pixels[i];
        if (!(mean > 0 && squared > 0)) continue;
        const double worth = squared / (mean * exposure.photons_per_sample);
        noisy.pixels[i] = static_cast<float>(worth * poisson(random, mean / worth));
    }
    return noisy;
}

/// Falls with the squared distance from the middle; `vignetting` is lost in the corners.
double light_left(const XrayModel& model, const Image& image, int x, int y) {
    const double dx = (x + 0.5) / image.width - 0.5, dy = (y + 0.5) / image.height - 0.5;
    return 1 - model.vignetting * 2 * (dx * dx + dy * dy);
}

}  // namespace

RawXray detected(const XrayModel& model, const XrayExposure& exposure, std::uint64_t seed) {
    check_xray_model(model, "X-ray model " + model.name);
    Random random(seed);
    Image light = with_quantum_noise(exposure, random);
    if (model.blur_mm > 0) {
        light = blurred(light, Eigen::Vector2d::Constant(model.blur_mm).cwiseQuotient(exposure.sample_pitch_mm));
    }
    RawXray raw;
    raw.image = binned(light, exposure.samples_per_pixel);
    raw.integer_pixels = model.bits > 0;
    raw.max_representable = model.bits > 0 ? std::ldexp(1.0, model.bits) - 1 : 0;
    raw.relation = IntensityRelation::linear;
    raw.relation_sign = 1;
    const double full = model.full_scale > 0 ? model.full_scale : 1;
    for (int y = 0; y < raw.image.height; ++y) {
        for (int x = 0; x < raw.image.width; ++x) {
            double share = raw.image(x, y) * light_left(model, raw.image, x, y) / full;
            if (model.electronic_noise > 0) share += model.electronic_noise * random.normal();
            share = model.floor_share + (1 - model.floor_share) * share;
            if (model.full_scale > 0) share = std::clamp(share, 0.0, 1.0);
            raw.image(x, y) =
                static_cast<float>(model.bits > 0 ? std::round(share * raw.max_representable) : share * full);
        }
    }
    return raw;
}

}  // namespace raylign
