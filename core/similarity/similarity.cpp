#include "core/similarity/similarity.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"

namespace raylign {
using namespace detail;
namespace {

double variance_sum(double weight, double sum, double sum_of_squares) { return sum_of_squares - sum * sum / weight; }

void check_fixed(const View& view) {
    const Eigen::Vector2i& size = view.geometry.camera.size_px;
    const std::string where = "view " + view.name;
    if (view.image.empty()) throw Error(where + ": has no image");
    const auto text = [](int w, int h) { return std::to_string(w) + " x " + std::to_string(h); };
    if (view.image.width != size.x() || view.image.height != size.y()) {
        throw bad_value("image size", text(view.image.width, view.image.height),
                        text(size.x(), size.y()) + " as its camera says", where);
    }
    if (!view.weights.empty() && (view.weights.width != size.x() || view.weights.height != size.y())) {
        throw bad_value("mask size", text(view.weights.width, view.weights.height),
                        text(size.x(), size.y()) + " as its image", where);
    }
    const auto pixel_name = [&](std::size_t i) {
        return "pixel (" + std::to_string(i % size.x()) + ", " + std::to_string(i / size.x()) + ")";
    };
    for (std::size_t i = 0; i < view.image.pixels.size(); ++i) {
        const float weight = view.weights.empty() ? 1 : view.weights.pixels[i];
        if (!(weight >= 0 && std::isfinite(weight))) {
            throw bad_value("weight of " + pixel_name(i), std::to_string(weight), "finite and not negative", where);
        }
        if (weight != 0 && !std::isfinite(view.image.pixels[i])) {
            throw bad_value(pixel_name(i), std::to_string(view.image.pixels[i]), "finite (or masked)", where);
        }
    }
}

}  // namespace

std::string_view metric_name(Metric metric) { return metric == Metric::gc ? "gc" : "ncc"; }

Metric metric_from_name(std::string_view name) {
    if (name == "gc") return Metric::gc;
    if (name == "ncc") return Metric::ncc;
    throw bad_value("metric", name, "gc or ncc");
}

int detail::channel_count(Metric metric) { return metric == Metric::gc ? 2 : 1; }

detail::MomentSums& detail::MomentSums::operator+=(const MomentSums& other) {
    weight += other.weight;
    fixed += other.fixed;
    fixed_fixed += other.fixed_fixed;
    moving += other.moving;
    moving_moving += other.moving_moving;
    fixed_moving += other.fixed_moving;
    return *this;
}

std::vector<Image> detail::moving_channels(const Image& drr, const Similarity& similarity) {
    if (similarity.metric == Metric::ncc) return {drr};
    auto gradients = gradient_images(drr, gradient_taps(similarity.filter));
    return {std::move(gradients[0]), std::move(gradients[1])};
}

FixedChannels detail::make_fixed_channels(const View& view, const Similarity& similarity) {
    check_fixed(view);
    FixedChannels fixed;
    fixed.weights = view.weights.empty() ? Image(view.image.width, view.image.height, 1) : view.weights;
    Image image = view.image;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (fixed.weights.pixels[i] == 0) image.pixels[i] = 0;  // keeps a masked NaN out of the filter's 0 * NaN
    }
    fixed.channels = moving_channels(image, similarity);
    if (similarity.metric == Metric::gc) fixed.weights = erode_weights(fixed.weights, similarity.filter.radius_px);

    const auto usable = fixed.weights.pixels.size() - std::ranges::count(fixed.weights.pixels, 0.F);
    if (usable < kMinPixels) {
        throw bad_value("usable pixels", std::to_string(usable),
                        "at least " + std::to_string(kMinPixels) + " after masking and eroding by the filter radius",
                        "view " + view.name);
    }
    for (const Image& channel : fixed.channels) {
        const MomentSums s = moment_sums(channel, channel, fixed.weights);
        if (moving_is_constant(s)) {
            throw Error("view " + view.name + ": the image is constant, its correlation is undefined");
        }
    }
    return fixed;
}

MomentSums detail::moment_sums(const Image& fixed, const Image& moving, const Image& weights) {
    MomentSums sums;
    // Row by row: one running sum over a million equal pixels rounds the same way each time, and the variance that
    // cancels from such sums no longer shows that the image is constant (1e-11 instead of 1e-13 of the second moment).
    for (int y = 0; y < fixed.height; ++y) {
        MomentSums row;
        for (int x = 0; x < fixed.width; ++x) {
            const double w = weights(x, y), a = fixed(x, y), b = moving(x, y);
            if (w == 0) continue;
            row += {w, w * a, w * a * a, w * b, w * b * b, w * a * b};
        }
        sums += row;
    }
    return sums;
}

bool detail::moving_is_constant(const MomentSums& s) {
    return variance_sum(s.weight, s.moving, s.moving_moving) <= kConstantShare * s.moving_moving;
}

double detail::normalized_cross_correlation(const MomentSums& s) {
    if (moving_is_constant(s)) return 0;
    const double fixed_variance = variance_sum(s.weight, s.fixed, s.fixed_fixed);
    const double moving_variance = variance_sum(s.weight, s.moving, s.moving_moving);
    const double covariance = s.fixed_moving - s.fixed * s.moving / s.weight;
    return covariance / std::sqrt(fixed_variance * moving_variance);
}

double detail::view_cost(std::span<const MomentSums> channels) {
    double sum = 0;
    for (const MomentSums& channel : channels) sum += normalized_cross_correlation(channel);
    return 1 - sum / static_cast<double>(channels.size());
}

}  // namespace raylign
