#include "core/registration/trust/confidence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"

namespace raylign::detail {
namespace {

constexpr int kBlocksPerSide = 8;

/// The group of each block: every group appears in each half of the rows and columns, shifted from view to view.
int group_of(int block_x, int block_y, std::size_t view) {
    return (5 * block_x + 3 * block_y + 7 * static_cast<int>(view)) % kGroups;
}

struct WeightBox {
    int x0, y0, x1, y1;
};

WeightBox box_with_weight(const Image& weights) {
    WeightBox box{weights.width, weights.height, 0, 0};
    for (int y = 0; y < weights.height; ++y) {
        for (int x = 0; x < weights.width; ++x) {
            if (!(weights(x, y) > 0)) continue;
            box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
        }
    }
    return box;
}

}  // namespace

Image without_group(const Image& weights, int group, std::size_t view) {
    const WeightBox box = box_with_weight(weights);
    Image rest = weights;
    for (int y = box.y0; y < box.y1; ++y) {
        const int block_y = (y - box.y0) * kBlocksPerSide / (box.y1 - box.y0);
        for (int x = box.x0; x < box.x1; ++x) {
            const int block_x = (x - box.x0) * kBlocksPerSide / (box.x1 - box.x0);
            if (group_of(block_x, block_y, view) == group) rest(x, y) = 0;
        }
    }
    return rest;
}

namespace {

using Twists = Eigen::Matrix<double, 6, kGroups>;

/// One Gauss-Newton step per group left out.
Twists steps_without_groups(const LevelProblem& problem, const RigidTransform& world_from_ct,
                            const std::vector<Image>& weights) {
    Twists steps;
    for (int group = 0; group < kGroups; ++group) {
        std::vector<Image> rest;
        for (std::size_t v = 0; v < weights.size(); ++v) rest.push_back(without_group(weights[v], group, v));
        problem.session.set_weights(rest);
        Linearization at;
        problem.before_batch();
        problem.session.linearize({&world_from_ct, 1}, problem.extent.centre_ct_mm, {&at, 1});
        steps.col(group) = -solve_symmetric(at.curvature, at.gradient);
    }
    return steps;
}

}  // namespace

void summarise(Confidence& confidence, double radius_mm) {
    const Eigen::Matrix3d rotation = confidence.covariance.topLeftCorner<3, 3>();
    const Eigen::Matrix3d translation = confidence.covariance.bottomRightCorner<3, 3>();
    confidence.translation_mm = std::sqrt(translation.trace());
    confidence.rotation_deg = std::sqrt(rotation.trace()) * 180 / std::numbers::pi;
    // Mean of |w x p|^2 over a uniform ball: 2/5 r^2 |w|^2.
    confidence.rim_mm = std::sqrt(translation.trace() + 0.4 * radius_mm * radius_mm * rotation.trace());
    const PrincipalAxes principal = principal_axes(translation);
    confidence.weakest_direction = principal.axes.col(2);
    confidence.weakest_mm = std::sqrt(std::max(principal.values[2], 0.0));
    const PrincipalAxes turns = principal_axes(rotation);
    confidence.weakest_axis = turns.axes.col(2);
    confidence.weakest_deg = std::sqrt(std::max(turns.values[2], 0.0)) * 180 / std::numbers::pi;
}

Confidence jackknife(const LevelProblem& problem, const RigidTransform& world_from_ct, double calibration) {
    std::vector<Image> weights;
    for (std::size_t v = 0; v < problem.session.view_count(); ++v) {
        weights.push_back(problem.session.fixed_channels(v).weights);
    }
    Confidence confidence;
    Twists steps;
    try {
        steps = steps_without_groups(problem, world_from_ct, weights);
    } catch (const Error& error) {
        problem.session.set_weights(weights);
        if (error.kind() != ErrorKind::input) throw;
        return confidence;  // a group held nearly all pixels
    } catch (...) {         // the run was stopped
        problem.session.set_weights(weights);
        throw;
    }
    problem.session.set_weights(weights);
    if (!steps.allFinite()) return confidence;
    const Twists deviations = steps.colwise() - steps.rowwise().mean();
    confidence.is_estimated = true;
    confidence.covariance = calibration * calibration * (kGroups - 1.0) / kGroups * deviations * deviations.transpose();
    summarise(confidence, problem.extent.radius_mm);
    return confidence;
}

void split_by_depth(Confidence& confidence, const Eigen::Vector3d& depth_axis) {
    if (!confidence.is_estimated) return;
    const Eigen::Matrix3d translation = confidence.covariance.bottomRightCorner<3, 3>();
    const double depth2 = std::max(0.0, depth_axis.dot(translation * depth_axis));
    confidence.in_depth_mm = std::sqrt(depth2);
    confidence.in_plane_mm = std::sqrt(std::max(0.0, confidence.rim_mm * confidence.rim_mm - depth2));
}

void add_model_error(Confidence& confidence, std::span<const ModelShift> shifts, double radius_mm) {
    if (!confidence.is_estimated) return;
    for (const ModelShift& shift : shifts) {
        confidence.covariance += kModelCalibration * kModelCalibration * shift.twist * shift.twist.transpose();
    }
    summarise(confidence, radius_mm);
}

}  // namespace raylign::detail
