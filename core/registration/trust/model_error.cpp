#include "core/registration/trust/model_error.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/image/gradient_filter.h"
#include "core/image/smooth.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

constexpr double kScatter = 0.4, kScatterWidth = 0.1, kHardening = 0.06;
constexpr double kBlur_px = 0.6;

Image arriving(Image integral) {
    for (float& pixel : integral.pixels) pixel = std::exp(-pixel);
    return integral;
}

Image integral_of(Image arriving) {
    for (float& pixel : arriving.pixels) pixel = -std::log(std::max(pixel, 1e-30F));
    return arriving;
}

/// Gaussian of half a pixel as three taps with its variance.
Image blurred(const Image& integral) {
    const Image in = arriving(integral);
    constexpr auto side = static_cast<float>(kBlur_px * kBlur_px / 2);
    Image rows = in, out = in;
    for (int y = 0; y < in.height; ++y) {
        for (int x = 1; x + 1 < in.width; ++x) {
            rows(x, y) = side * (in(x - 1, y) + in(x + 1, y)) + (1 - 2 * side) * in(x, y);
        }
    }
    out = rows;
    for (int y = 1; y + 1 < in.height; ++y) {
        for (int x = 0; x < in.width; ++x) {
            out(x, y) = side * (rows(x, y - 1) + rows(x, y + 1)) + (1 - 2 * side) * rows(x, y);
        }
    }
    return integral_of(std::move(out));
}

Image scattered(const Image& integral) {
    Image primary = arriving(integral);
    const Image wide = smoothed(primary, std::clamp(kScatterWidth * primary.width, 1.0, 1000.0));
    for (std::size_t i = 0; i < primary.pixels.size(); ++i) {
        primary.pixels[i] = static_cast<float>((primary.pixels[i] + kScatter * wide.pixels[i]) / (1 + kScatter));
    }
    return integral_of(std::move(primary));
}

Image hardened(Image integral) {
    for (float& pixel : integral.pixels) pixel /= 1 + static_cast<float>(kHardening) * std::max(pixel, 0.F);
    return integral;
}

struct Distortion {
    std::string_view what;
    Image (*real)(const Image& integral);
};

std::vector<Distortion> distortions(double residual) {
    const Distortion blur{"blur", [](const Image& image) { return blurred(image); }};
    const Distortion scatter{"scatter", [](const Image& image) { return scattered(image); }};
    const Distortion hardening{"hardening", [](const Image& image) { return hardened(image); }};
    return {blur, residual < kRobustFrom_cost ? hardening : scatter};
}

/// A session whose X-rays are the DRRs at the pose, distorted, with the level's weights.
std::unique_ptr<Session> distorted_session(Level& level, const RigidTransform& world_from_ct,
                                           const Distortion& distortion) {
    std::vector<Image> weights;
    std::vector<View> views(level.views().begin(), level.views().end());
    for (std::size_t v = 0; v < views.size(); ++v) {
        weights.push_back(level.session().fixed_channels(v).weights);
        views[v].image = distortion.real(level.session().render(world_from_ct, v));
    }
    std::unique_ptr<Session> session = level.with_views(views);
    session->set_weights(weights);
    return session;
}

ModelShift shift_of(const Distortion& distortion, const Linearization& at, double residual) {
    const double share = at.cost > residual ? std::sqrt(std::max(residual, 0.0) / at.cost) : 1;
    return {distortion.what, share, share * Twist(-solve_symmetric(at.curvature, at.gradient))};
}

Eigen::Vector3d centre_of(Level& level, const RigidTransform& world_from_ct) {
    return level.problem(world_from_ct, false).extent.centre_ct_mm;
}

}  // namespace

std::vector<ModelShift> model_shifts(Level& level, const RigidTransform& world_from_ct, double residual) {
    std::vector<ModelShift> shifts;
    for (const Distortion& distortion : distortions(residual)) {
        const std::unique_ptr<Session> session = distorted_session(level, world_from_ct, distortion);
        Linearization at;
        session->linearize({&world_from_ct, 1}, centre_of(level, world_from_ct), {&at, 1});
        level.count(*session);
        shifts.push_back(shift_of(distortion, at, residual));
    }
    return shifts;
}

std::vector<std::vector<ModelShift>> model_shifts_of_views(Level& level, const RigidTransform& world_from_ct,
                                                           std::span<const double> residuals) {
    std::vector<std::vector<ModelShift>> shifts(residuals.size());
    for (const Distortion& distortion : distortions(*std::ranges::max_element(residuals))) {
        const std::unique_ptr<Session> session = distorted_session(level, world_from_ct, distortion);
        std::vector<Linearization> at(residuals.size());
        session->linearize_views({&world_from_ct, 1}, centre_of(level, world_from_ct), at);
        level.count(*session);
        for (std::size_t v = 0; v < at.size(); ++v) shifts[v].push_back(shift_of(distortion, at[v], residuals[v]));
    }
    return shifts;
}

}  // namespace raylign::detail
