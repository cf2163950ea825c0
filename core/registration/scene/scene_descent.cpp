#include "core/registration/scene/scene_descent.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/number_text.h"
#include "core/image/pyramid.h"
#include "core/registration/level/plan.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

constexpr double kStep_px = 25;  // longest step of an object at its rim
// Each object is finished alone, far below this, against what the others leave at the poses found here.
constexpr double kTolerance_coarse_px = 2e-2, kTolerance_finest_px = 5e-3;
constexpr double kLeastDecrease_coarse = 1e-6, kLeastDecrease_finest = 1e-8;
constexpr int kRobustRounds = 3;
constexpr double kRobustSettled_px = 0.02;  // a renewal of weights that moves no object's rim farther is the last
constexpr double kFineShare = 0.25;         // of the filter's width: a bone's fine edges are its own, wide ones are not
constexpr double kLeastSigma_px = 0.5;

/// One level for all: the pyramid of the object that allows the fewest levels.
struct ScenePlan {
    LevelPlan images;
    std::vector<int> volume_halvings;  ///< per object
};

std::vector<LevelPlan> plan_of(const SceneDescent& scene, std::span<const View> views, std::size_t k) {
    const ResidentVolume& volume = *scene.volumes[k];
    return plan_levels(volume.volume(), views, scene.world_from_ct[k], volume.extent(), scene.options.similarity.filter,
                       scene.options.levels);
}

std::vector<ScenePlan> plan_scene(const SceneDescent& scene, std::span<const View> views) {
    std::vector<std::vector<LevelPlan>> own;
    for (std::size_t k = 0; k < scene.volumes.size(); ++k) own.push_back(plan_of(scene, views, k));
    const std::size_t guide = *std::ranges::min_element(scene.guides, {}, [&](std::size_t k) { return own[k].size(); });
    std::vector<ScenePlan> plans;
    for (const LevelPlan& images : own[guide]) {
        plans.push_back({images, {}});
        for (const auto& levels : own) plans.back().volume_halvings.push_back(volume_halvings_like(levels, images));
    }
    return plans;
}

SceneLevel make_level(SceneDescent& scene, const ScenePlan& plan, const GradientFilter& filter) {
    SceneLevel level;
    level.similarity = {scene.options.similarity.metric, filter};
    level.pixel_at_object_mm = plan.images.pixel_at_object_mm;
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        View view = halved(scene.views[v], plan.images.image_halvings[v]);
        level.fixed.push_back(make_fixed_channels(view, level.similarity));
        level.views.push_back(std::move(view));
    }
    for (std::size_t k = 0; k < scene.volumes.size(); ++k) {
        level.objects.emplace_back(*scene.volumes[k], plan.volume_halvings[k], level.views, level.similarity,
                                   level.pixel_at_object_mm);
        level.objects.back().show(scene.world_from_ct[k]);
    }
    weigh_scene(level, kDomainMargin_mm);
    return level;
}

/// True where the caller or the clock ends the run.
bool is_over(SceneDescent& scene) {
    if (scene.control.meanwhile) scene.control.meanwhile();
    if (scene.control.stop.stop_requested()) {
        scene.stopped_by = "stopped by the caller: the best pose so far";
    } else if (scene.options.time_limit_s && elapsed_s(scene) > *scene.options.time_limit_s) {
        scene.stopped_by =
            "the time limit of " + number_text(*scene.options.time_limit_s) + " s was over: the best pose so far";
    }
    return scene.stopped_by.has_value();
}

/// The scene with the joints' limits, which count as much as the X-rays, as they are explained at the start of this
/// level, leave room for.
class JointScene {
public:
    JointScene(const SceneDescent& scene, SceneLevel& level)
        : scene_(scene), level_(level), noise_(scene.pulling.empty() ? 0 : cost_noise(level)) {}

    [[nodiscard]] LocalModel model(const SceneCast& cast) {
        LocalModel model = scene_model(level_, cast);
        if (!scene_.pulling.empty()) add_joints(scene_.pulling, cast.world_from_ct, ends(cast), noise_, model);
        return model;
    }
    /// What the limits have of a model's cost.
    [[nodiscard]] double share(std::span<const RigidTransform> world_from_ct) const {
        return noise_ * joint_cost(scene_.pulling, world_from_ct);
    }

private:
    [[nodiscard]] std::vector<JointEnd> ends(const SceneCast& cast) const {
        std::vector<JointEnd> ends(cast.world_from_ct.size());
        for (std::size_t i = 0; i < cast.moving.size(); ++i) {
            const std::size_t k = cast.moving[i];
            const ObjectExtent& extent = scene_.volumes[k]->extent();
            ends[k] = {static_cast<Eigen::Index>(6 * i), cast.world_from_ct[k] * extent.centre_ct_mm, extent.radius_mm};
        }
        return ends;
    }

    const SceneDescent& scene_;
    SceneLevel& level_;
    double noise_;
};

/// Where a descent begins and ends.
enum class Approach {
    from_afar,  ///< from a coarser level
    renewed,    ///< from near its end, under new weights
    to_the_end,
};

LevenbergMarquardtOptions descent_options(const SceneDescent& scene, double pixel_mm, Approach approach) {
    const bool is_last = approach == Approach::to_the_end;
    return {.max_step = kStep_px * pixel_mm * std::sqrt(static_cast<double>(scene.moving.size())),
            .step_tolerance = (is_last ? kTolerance_finest_px : kTolerance_coarse_px) * pixel_mm,
            .decrease_tolerance = is_last ? kLeastDecrease_finest : kLeastDecrease_coarse,
            .max_iterations = scene.options.max_iterations_per_level,
            .learns = approach != Approach::from_afar};
}

/// Moves the poses on this level until the cost no longer falls.
void optimize(SceneDescent& scene, SceneLevel& level, Approach approach) {
    SceneCast cast{scene.world_from_ct, scene.moving};
    JointScene jointed(scene, level);
    LevenbergMarquardtSearch search(jointed.model(cast), descent_options(scene, level.pixel_at_object_mm, approach));
    while (!search.done() && !is_over(scene)) {
        SceneCast trial = cast;
        for (std::size_t i = 0; i < cast.moving.size(); ++i) {
            const std::size_t k = cast.moving[i];
            const Eigen::VectorXd own = search.step().segment<6>(static_cast<Eigen::Index>(6 * i));
            trial.world_from_ct[k] = make_pose_space(cast.world_from_ct[k], scene.volumes[k]->extent()).pose(own);
        }
        if (search.take(jointed.model(trial))) cast = trial;
    }
    scene.iterations += search.result().iterations;
    scene.world_from_ct = cast.world_from_ct;
    scene.cost_final = search.result().model.cost - jointed.share(cast.world_from_ct);
    for (std::size_t k = 0; k < scene.volumes.size(); ++k) level.objects[k].show(scene.world_from_ct[k]);
}

GradientFilter fine(const GradientFilter& filter) {
    GradientFilter narrow = filter;
    narrow.sigma_px = std::max(kLeastSigma_px, filter.sigma_px * kFineShare);
    narrow.radius_px = std::max(2, static_cast<int>(std::ceil(3 * narrow.sigma_px)));
    return narrow;
}

/// DRRs of the views as given at the poses, and their gain: what others are judged against.
void show_in_full(SceneDescent& scene, const SceneLevel& level) {
    scene.shown = {std::vector<std::vector<Image>>(scene.volumes.size()), scene_gains(level)};
    for (std::size_t k = 0; k < scene.volumes.size(); ++k) show_anew(scene, k);
}

double farthest_mm(const SceneDescent& scene, std::span<const RigidTransform> before) {
    double farthest = 0;
    for (const std::size_t k : scene.moving) {
        farthest = std::max(farthest, apart_mm(before[k], scene.world_from_ct[k], scene.volumes[k]->extent()));
    }
    return farthest;
}

/// The finest level with a fine filter and robust weights, renewed until they settle.
void finish_on(SceneDescent& scene, const ScenePlan& plan) {
    SceneLevel level = make_level(scene, plan, fine(scene.options.similarity.filter));
    for (int round = 1; scene.options.robust && round <= kRobustRounds && !scene.stopped_by; ++round) {
        const std::vector<RigidTransform> before = scene.world_from_ct;
        reweigh_scene(level);
        optimize(scene, level, Approach::renewed);
        if (farthest_mm(scene, before) < kRobustSettled_px * level.pixel_at_object_mm) break;
    }
    if (!scene.stopped_by) optimize(scene, level, Approach::to_the_end);
    show_in_full(scene, level);
    scene.cost_initial = scene_cost(level, scene.starts_world_from_ct);
}

}  // namespace

void descend_together(SceneDescent& scene) {
    const std::vector<ScenePlan> plans = plan_scene(scene, scene.views);
    for (const ScenePlan& plan : plans) {
        const bool is_last = &plan == &plans.back();
        if (is_last || is_over(scene)) break;
        // Wide gradients of tissue that is no object can lead bones anywhere, even from their right places.
        SceneLevel level = make_level(scene, plan, scene.has_rest ? plan.images.filter : fine(plan.images.filter));
        optimize(scene, level, Approach::from_afar);
        show_scene_progress(scene, 0.4 * static_cast<double>(&plan - plans.data() + 1) / plans.size());
        if (!scene.options.robust) continue;
        reweigh_scene(level);
        optimize(scene, level, Approach::renewed);
    }
    finish_on(scene, plans.back());
}

double elapsed_s(const SceneDescent& scene) { return seconds_since(scene.begin); }

void show_scene_progress(const SceneDescent& scene, double fraction) {
    if (!scene.control.on_progress) return;
    scene.control.on_progress({.iteration = scene.iterations,
                               .cost = scene.cost_final,
                               .fraction = fraction,
                               .remaining_s = elapsed_s(scene) * (1 - fraction) / std::max(fraction, 1e-3)});
}

void follow_together(SceneDescent& scene, int coarser_by) {
    const std::vector<ScenePlan> plans = plan_scene(scene, bare(scene.views));
    SceneLevel level = make_level(scene, coarser(plans, coarser_by), fine(scene.options.similarity.filter));
    if (scene.options.robust) reweigh_scene(level);
    if (!scene.moving.empty()) optimize(scene, level, Approach::renewed);
    scene.shown = {{}, scene_gains(level)};
}

void show_anew(SceneDescent& scene, std::size_t k) {
    const std::vector<int> in_full(scene.views.size(), 0);
    scene.shown.drrs[k] = drawn(*scene.volumes[k], scene.world_from_ct[k], scene.views, {0, in_full});
}

void finish_together(SceneDescent& scene) { finish_on(scene, plan_scene(scene, scene.views).back()); }

bool try_poses(SceneDescent& scene, const std::vector<RigidTransform>& then) {
    const ScenePlan plan = plan_scene(scene, scene.views).back();
    const GradientFilter filter = fine(scene.options.similarity.filter);
    const std::vector<RigidTransform> now = scene.world_from_ct;
    SceneLevel level = make_level(scene, plan, filter);
    scene.world_from_ct = then;
    // What one pose leaves unexplained may lie where only the other reaches.
    for (std::size_t v = 0; const FixedChannels& there : make_level(scene, plan, filter).fixed) {
        std::vector<float>& weights = level.fixed[v++].weights.pixels;
        std::ranges::transform(weights, there.weights.pixels, weights.begin(), std::ranges::max);
    }
    scene.world_from_ct = now;
    const JointScene jointed(scene, level);
    const double before = scene_cost(level, now) + jointed.share(now);
    if (!(scene_cost(level, then) + jointed.share(then) < before)) return false;
    scene.world_from_ct = then;
    return true;
}

}  // namespace raylign::detail
