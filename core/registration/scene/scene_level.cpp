#include "core/registration/scene/scene_level.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/image/gradient_filter.h"
#include "core/image/smooth.h"
#include "core/registration/policy.h"
#include "core/similarity/robust_weights.h"

namespace raylign::detail {
namespace {

constexpr float kFloor_share = 0.05F;  // of the mean energy: empty background must not become the loudest part

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Weighted sums of one channel with the derivatives of all moving objects.
struct ChannelSums {
    MomentSums moments;
    VectorXd jacobian, fixed_jacobian, moving_jacobian;  ///< sum w J, sum w A J, sum w B J
    MatrixXd jacobian_jacobian;
};

/// Pixels that two windows share.
PixelBox common(const PixelBox& a, const PixelBox& b) { return {a.begin.cwiseMax(b.begin), a.end.cwiseMin(b.end)}; }

using Columns = Eigen::Matrix<float, 6, Eigen::Dynamic>;

/// Columns of a footprint's pixels (x0.., y), `count` of them, in pixels of the view.
auto row_of(const Footprint& footprint, const Columns& columns, int x0, int y, int count) {
    const PixelBox& box = footprint.box;
    const Eigen::Index width = box.end.x() - box.begin.x();
    return columns.middleCols((y - box.begin.y()) * width + x0 - box.begin.x(), count);
}

auto row_of(const Image& image, int x0, int y, int count) {
    return Eigen::Map<const Eigen::RowVectorXf>(image.pixels.data() + image.index(x0, y), count);
}

/// One object's own sums, and its block with every later one.
void add_object(const SceneLevel& level, const SceneCast& cast, std::size_t view, std::size_t channel, std::size_t k,
                const Image& moving, ChannelSums& sums) {
    const FixedChannels& fixed = level.fixed[view];
    const Footprint& own = level.objects[cast.moving[k]].footprint(view);
    const auto at = static_cast<Eigen::Index>(6 * k);
    for (std::size_t l = k; l < cast.moving.size(); ++l) {
        const Footprint& other = level.objects[cast.moving[l]].footprint(view);
        const PixelBox box = common(own.box, other.box);
        const int count = box.end.x() - box.begin.x();
        if (count <= 0) continue;
        Eigen::Matrix<double, 6, 6> block = Eigen::Matrix<double, 6, 6>::Zero();
        for (int y = box.begin.y(); y < box.end.y(); ++y) {
            const auto weights = row_of(fixed.weights, box.begin.x(), y, count);
            const Columns weighted = row_of(own, own.jacobian[channel], box.begin.x(), y, count) * weights.asDiagonal();
            const auto theirs = row_of(other, other.jacobian[channel], box.begin.x(), y, count);
            block += (weighted * theirs.transpose()).cast<double>();
            if (l != k) continue;
            const auto a = row_of(fixed.channels[channel], box.begin.x(), y, count);
            const auto b = row_of(moving, box.begin.x(), y, count);
            sums.jacobian.segment<6>(at) += weighted.rowwise().sum().cast<double>();
            sums.fixed_jacobian.segment<6>(at) += (weighted * a.transpose()).cast<double>();
            sums.moving_jacobian.segment<6>(at) += (weighted * b.transpose()).cast<double>();
        }
        const auto across = static_cast<Eigen::Index>(6 * l);
        sums.jacobian_jacobian.block<6, 6>(at, across) = block;
        sums.jacobian_jacobian.block<6, 6>(across, at) = block.transpose();
    }
}

/// As linearize_channel, of any number of parameters.
LocalModel model_of(const ChannelSums& sums) {
    const MomentSums& m = sums.moments;
    const Eigen::Index n = sums.jacobian.size();
    const double correlation = normalized_cross_correlation(m);
    LocalModel model{1 - correlation, VectorXd::Zero(n), MatrixXd::Zero(n, n)};
    if (moving_is_constant(m)) return model;
    const double fixed_norm = std::sqrt(m.fixed_fixed - m.fixed * m.fixed / m.weight);
    const double moving_norm = std::sqrt(m.moving_moving - m.moving * m.moving / m.weight);
    const VectorXd mean = sums.jacobian / m.weight;
    const VectorXd along_fixed = (sums.fixed_jacobian - m.fixed * mean) / fixed_norm;
    const VectorXd along_moving = (sums.moving_jacobian - m.moving * mean) / moving_norm;
    const MatrixXd centred = sums.jacobian_jacobian - m.weight * mean * mean.transpose();
    model.gradient = -(along_fixed - correlation * along_moving) / moving_norm;
    model.curvature = (centred - along_moving * along_moving.transpose()) / (moving_norm * moving_norm);
    return model;
}

LocalModel view_model(const SceneLevel& level, const SceneCast& cast, std::size_t view) {
    const auto n = static_cast<Eigen::Index>(6 * cast.moving.size());
    const std::vector<Image> sum = sum_of_footprints(level, view);
    LocalModel mean{0, VectorXd::Zero(n), MatrixXd::Zero(n, n)};
    for (std::size_t c = 0; c < sum.size(); ++c) {
        const FixedChannels& fixed = level.fixed[view];
        ChannelSums sums{moment_sums(fixed.channels[c], sum[c], fixed.weights), VectorXd::Zero(n), VectorXd::Zero(n),
                         VectorXd::Zero(n), MatrixXd::Zero(n, n)};
        for (std::size_t k = 0; k < cast.moving.size(); ++k) add_object(level, cast, view, c, k, sum[c], sums);
        const LocalModel model = model_of(sums);
        const double share = 1.0 / static_cast<double>(sum.size());
        mean.cost += share * model.cost;
        mean.gradient += share * model.gradient;
        mean.curvature += share * model.curvature;
    }
    return mean;
}

std::vector<double> view_shares(const SceneLevel& level) {
    double all = 0;
    for (const View& view : level.views) all += view.cost_weight;
    std::vector<double> shares;
    for (const View& view : level.views) shares.push_back(view.cost_weight / all);
    return shares;
}

/// 1 within the margin of what any object's DRR reaches, else 0.
Image reached(const SceneLevel& level, std::size_t view, int margin_px) {
    const Eigen::Vector2i size = level.views[view].geometry.camera.size_px;
    Image outside(size.x(), size.y(), 1);
    for (const ObjectImages& object : level.objects) {
        const Footprint& footprint = object.footprint(view);
        for (int y = 0; y < footprint.drr.height; ++y) {
            for (int x = 0; x < footprint.drr.width; ++x) {
                if (footprint.drr(x, y) > 0) outside(footprint.box.begin.x() + x, footprint.box.begin.y() + y) = 0;
            }
        }
    }
    if (margin_px > 0) outside = erode_weights(outside, margin_px);
    for (float& pixel : outside.pixels) pixel = 1 - pixel;
    return outside;
}

/// mean(E) / (E_local + mean(E) / 20), E the squared channels: level/pixel_weights.h says why.
Image evened(const FixedChannels& fixed, double sigma_px) {
    Image energy(fixed.weights.width, fixed.weights.height);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < energy.pixels.size(); ++i) {
        if (fixed.weights.pixels[i] == 0) continue;
        for (const Image& channel : fixed.channels) energy.pixels[i] += channel.pixels[i] * channel.pixels[i];
        sum += energy.pixels[i];
        ++count;
    }
    const auto mean = static_cast<float>(sum / std::max(count, 1.0));
    Image local = smoothed(energy, std::clamp(sigma_px, 1.0, 1000.0));
    for (float& pixel : local.pixels) pixel = mean / (pixel + kFloor_share * mean);
    return local;
}

std::ptrdiff_t usable(const Image& weights) {
    return std::ssize(weights.pixels) - std::ranges::count(weights.pixels, 0.F);
}

}  // namespace

std::vector<Image> sum_of_footprints(const SceneLevel& level, std::size_t view) {
    const Eigen::Vector2i size = level.views[view].geometry.camera.size_px;
    std::vector<Image> sum(channel_count(level.similarity.metric), Image(size.x(), size.y()));
    for (const ObjectImages& object : level.objects) {
        const Footprint& footprint = object.footprint(view);
        for (std::size_t c = 0; c < sum.size(); ++c) {
            const Image& own = footprint.channels[c];
            for (int y = 0; y < own.height; ++y) {
                float* into = &sum[c](footprint.box.begin.x(), footprint.box.begin.y() + y);
                for (int x = 0; x < own.width; ++x) into[x] += own(x, y);
            }
        }
    }
    return sum;
}

/// Cost of the footprints as shown.
double shown_cost(const SceneLevel& level) {
    const std::vector<double> shares = view_shares(level);
    double cost = 0;
    for (std::size_t v = 0; v < level.views.size(); ++v) {
        const std::vector<Image> sum = sum_of_footprints(level, v);
        std::vector<MomentSums> sums;
        for (std::size_t c = 0; c < sum.size(); ++c) {
            sums.push_back(moment_sums(level.fixed[v].channels[c], sum[c], level.fixed[v].weights));
        }
        cost += shares[v] * view_cost(sums);
    }
    return cost;
}

double scene_cost(SceneLevel& level, std::span<const RigidTransform> world_from_ct) {
    for (std::size_t k = 0; k < level.objects.size(); ++k) level.objects[k].show(world_from_ct[k]);
    return shown_cost(level);
}

double cost_noise(const SceneLevel& level) {
    const GradientFilter& filter = level.similarity.filter;
    const double of_one_px = 4 * std::numbers::pi * std::max(0.25, filter.sigma_px * filter.sigma_px);
    double values = 0;
    for (const FixedChannels& fixed : level.fixed) {
        values += static_cast<double>(fixed.channels.size()) * static_cast<double>(usable(fixed.weights)) / of_one_px;
    }
    return 2 * shown_cost(level) / std::max(values, 1.0);
}

LocalModel scene_model(SceneLevel& level, const SceneCast& cast) {
    for (std::size_t k = 0; k < level.objects.size(); ++k) level.objects[k].show(cast.world_from_ct[k]);
    for (const std::size_t k : cast.moving) level.objects[k].differentiate();
    const auto n = static_cast<Eigen::Index>(6 * cast.moving.size());
    const std::vector<double> shares = view_shares(level);
    LocalModel all{0, VectorXd::Zero(n), MatrixXd::Zero(n, n)};
    for (std::size_t v = 0; v < level.views.size(); ++v) {
        const LocalModel model = view_model(level, cast, v);
        all.cost += shares[v] * model.cost;
        all.gradient += shares[v] * model.gradient;
        all.curvature += shares[v] * model.curvature;
    }
    return all;
}

void weigh_scene(SceneLevel& level, double margin_mm) {
    const int margin_px =
        static_cast<int>(std::ceil(margin_mm / level.pixel_at_object_mm)) + level.similarity.filter.radius_px;
    for (std::size_t v = 0; v < level.views.size(); ++v) {
        FixedChannels& fixed = level.fixed[v];
        const Image domain = reached(level, v, margin_px);
        const Image even = evened(fixed, kNormalisation_mm / level.pixel_at_object_mm);
        Image weights = fixed.weights;
        for (std::size_t i = 0; i < weights.pixels.size(); ++i) weights.pixels[i] *= domain.pixels[i] * even.pixels[i];
        if (usable(weights) >= kMinPixels) fixed.weights = std::move(weights);
        level.base_weights.push_back(fixed.weights);
    }
}

void reweigh_scene(SceneLevel& level) {
    for (std::size_t v = 0; v < level.views.size(); ++v) {
        FixedChannels& fixed = level.fixed[v];
        fixed.weights = level.base_weights[v];
        const Image robust = robust_weights(fixed, sum_of_footprints(level, v));
        for (std::size_t i = 0; i < robust.pixels.size(); ++i) fixed.weights.pixels[i] *= robust.pixels[i];
    }
}

std::vector<double> scene_gains(const SceneLevel& level) {
    std::vector<double> gains;
    for (std::size_t v = 0; v < level.views.size(); ++v) {
        const FixedChannels& fixed = level.fixed[v];
        const std::vector<Image> sum = sum_of_footprints(level, v);
        double covariance = 0, variance = 0;
        for (std::size_t c = 0; c < sum.size(); ++c) {
            const MomentSums m = moment_sums(fixed.channels[c], sum[c], fixed.weights);
            if (moving_is_constant(m)) continue;
            covariance += m.fixed_moving - m.fixed * m.moving / m.weight;
            variance += m.moving_moving - m.moving * m.moving / m.weight;
        }
        gains.push_back(variance > 0 ? std::max(0.0, covariance / variance) : 0);
    }
    return gains;
}

}  // namespace raylign::detail
