#pragma once

#include <deque>
#include <span>
#include <vector>

#include "core/optimize/levenberg_marquardt.h"
#include "core/registration/scene/footprint.h"
#include "core/similarity/similarity.h"

namespace raylign::detail {

/// One resolution of a scene: the views, what they show, and every object's footprints.
struct SceneLevel {
    std::vector<View> views;
    Similarity similarity;
    double pixel_at_object_mm = 1;
    std::vector<FixedChannels> fixed;  ///< per view, with the weights in use
    std::vector<Image> base_weights;   ///< per view: what `fixed` has without robust weights
    std::deque<ObjectImages> objects;
};

/// Which objects are compared, and which of them move.
struct SceneCast {
    std::vector<RigidTransform> world_from_ct;  ///< per object
    std::vector<std::size_t> moving;            ///< positions among them
};

/// The channels of one view that the objects' footprints add up to: M = sum_k D_k.
[[nodiscard]] std::vector<Image> sum_of_footprints(const SceneLevel& level, std::size_t view);

/// Cost of the scene at these poses: as Session::evaluate has it, of the sum of all DRRs.
[[nodiscard]] double scene_cost(SceneLevel& level, std::span<const RigidTransform> world_from_ct);

/// Cost, gradient and Gauss-Newton matrix of the scene with respect to the six PoseSpace parameters of every moving
/// object, one after another. Per channel, with J_k the filtered derivatives of object k, ~ mean-free under the
/// weights, a and b the mean-free unit-norm X-ray and sum, B~ the mean-free sum:
///   gradient_k = -(J~_k^T a - N J~_k^T b) / |B~|,
///   H_kl       = (J~_k^T J~_l - (J~_k^T b) (J~_l^T b)^T) / |B~|^2,
/// cross blocks where footprints meet. Objects that stay need no derivatives.
[[nodiscard]] LocalModel scene_model(SceneLevel& level, const SceneCast& cast);

/// Weights: within `margin_mm` (at the object) of what the objects' DRRs reach, times what evens out the X-ray's
/// gradients.
void weigh_scene(SceneLevel& level, double margin_mm);

/// Renews robust weights from what nobody explains at the poses shown.
void reweigh_scene(SceneLevel& level);

/// What a cost is to be divided by to be minus the logarithm of a likelihood, were what nobody explains at the poses
/// shown noise: 2 cost / n, n the independent values of all views and channels, one per 4 pi sigma^2 pixels of the
/// filter.
[[nodiscard]] double cost_noise(const SceneLevel& level);

/// Gain per view by which the sum of all objects at the poses shown fits the X-ray best, channels and weights as in
/// use; 0 where the sum is constant or opposes the X-ray.
[[nodiscard]] std::vector<double> scene_gains(const SceneLevel& level);

}  // namespace raylign::detail
