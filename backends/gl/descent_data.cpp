#include "backends/gl/descent_data.h"

#include <algorithm>

#include "core/backend.h"
#include "core/geometry/dominant_axis.h"

namespace raylign::detail::gl {
namespace {

constexpr double kInfinite = 1e30;  ///< floats have that, and its product with 0 is no NaN

static_assert(static_cast<int>(Termination::converged) == 0 && static_cast<int>(Termination::max_iterations) == 1 &&
              static_cast<int>(Termination::non_finite_cost) == 2);

void put_pose(double* to, const RigidTransform& pose) {
    put(to, pose.rotation);
    put(to + 9, pose.translation_mm);
}

}  // namespace

RigidTransform pose_of(const double* from) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(from);
    return {rotation, Eigen::Map<const Eigen::Vector3d>(from + 9)};
}

shared::ViewModel model_of(const Linearization& at) {
    shared::ViewModel model{};
    model.cost = at.cost;
    put(model.gradient, at.gradient);
    for (int i = 0, k = 0; i < 6; ++i) {
        for (int j = i; j < 6; ++j) model.curvature[k++] = at.curvature(i, j);
    }
    return model;
}

Linearization linearization_of(const shared::ViewModel& model) {
    Linearization at;
    at.cost = model.cost;
    for (int i = 0, k = 0; i < 6; ++i) {
        at.gradient[i] = model.gradient[i];
        for (int j = i; j < 6; ++j) at.curvature(i, j) = at.curvature(j, i) = model.curvature[k++];
    }
    return at;
}

shared::SearchData search_from(const DescentStart& start, double damping) {
    shared::SearchData search{};
    put_pose(search.base, start.world_from_ct);
    put_pose(search.trial, start.world_from_ct);
    search.damping = damping;
    search.state = start.views.empty() ? shared::kToLook : shared::kKnown;
    search.is_fresh = 1;
    return search;
}

std::vector<shared::CameraData> cameras_of(std::span<const DescentView> views,
                                           std::span<const MomentSums> static_sums) {
    const std::size_t channels = static_sums.size() / views.size();
    std::vector<shared::CameraData> cameras;
    for (const DescentView& view : views) {
        shared::CameraData camera{};
        put(camera.source, view.source_world_mm);
        put(camera.world_from_pixel, view.world_from_pixel);
        camera.depth_max = std::min(view.depth_max_mm, kInfinite);
        camera.ceiling = std::min(view.ceiling, kInfinite);
        camera.share = view.share;
        for (std::size_t c = 0; c < channels; ++c) {
            const MomentSums& own = static_sums[cameras.size() * channels + c];
            put(&camera.static_sums[3 * c], Eigen::Vector3d(own.weight, own.fixed, own.fixed_fixed));
        }
        cameras.push_back(camera);
    }
    return cameras;
}

shared::DescentData rules_of(const DescentProblem& problem, const VoxelGrid& grid) {
    using Rule = LevenbergMarquardtRule;
    const LevenbergMarquardtOptions& options = problem.options;
    shared::DescentData data{};
    put(data.voxel_from_ct, Eigen::Matrix3d(grid.spacing_mm.cwiseInverse().asDiagonal() * grid.direction.transpose()));
    put(data.origin_ct, grid.origin_mm);
    put(data.centre_ct, problem.centre_ct_mm);
    data.radius = problem.radius_mm;
    data.max_step = options.max_step;
    data.step_tolerance = options.step_tolerance;
    data.decrease_tolerance = options.decrease_tolerance;
    data.longest_of_plain = Rule::longest_of_plain;
    data.damping_down = Rule::damping_down;
    data.damping_up = Rule::damping_up;
    data.least_damping_up = Rule::least_damping_up;
    data.least_damping = Rule::least_damping;
    data.largest_damping = Rule::largest_damping;
    data.least_of_diagonal = Rule::least_of_diagonal;
    data.constant_share = kConstantShare;
    data.axis_bias = 2 * kAxisBias;
    data.farthest_source = kFarthestSource_voxels;
    data.max_iterations = static_cast<GLuint>(options.max_iterations);
    data.learns = options.learns ? 1 : 0;
    return data;
}

}  // namespace raylign::detail::gl
