#include "core/registration/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/registration/object/overlap.h"
#include "core/registration/policy.h"
#include "core/registration/registration.h"
#include "core/registration/scene/scene_descent.h"
#include "core/registration/scene/scene_doubts.h"
#include "core/registration/scene/scene_judgement.h"

namespace raylign::detail {
namespace {

constexpr int kRounds = 2;  // of judging and moving together again

void check_scene_options(std::span<const SceneObject> objects, const RegistrationOptions& options,
                         const Backend& backend) {
    check_options(options, backend);
    if (options.method != Method::automatic && options.method != Method::gauss_newton) {
        throw bad_value("method of several objects", method_name(options.method), "auto or gauss-newton");
    }
    if (options.refine_views) throw Error("refine_views: not with several objects");
    const bool moves = std::ranges::any_of(objects, [](const auto& o) { return o.mobility == Mobility::moves; });
    if (!moves) throw Error("objects: at least one must move");
    for (std::size_t a = 0; a < objects.size(); ++a) {
        if (!is_finite(objects[a].start_world_from_ct)) {
            throw Error("start pose of " + objects[a].name + ": must have finite numbers only");
        }
        for (std::size_t b = 0; b < a; ++b) {
            if (objects[a].name == objects[b].name) throw Error("objects: two are called " + objects[a].name);
        }
    }
}

std::string joint_name(std::span<const SceneObject> objects, const JointLimit& limit) {
    return "joint of " + objects[limit.first].name + " and " + objects[limit.second].name;
}

void check_limits(std::span<const SceneObject> objects, std::span<const JointLimit> limits) {
    for (std::size_t j = 0; j < limits.size(); ++j) {
        const JointLimit& limit = limits[j];
        if (limit.first >= objects.size() || limit.second >= objects.size()) throw Error("joint: no such object");
        const std::string name = joint_name(objects, limit);
        if (limit.first == limit.second) throw Error(name + ": needs two objects");
        if (!(limit.apart_mm > 0 && limit.apart_mm <= 100)) {
            throw bad_value(name, number_text(limit.apart_mm) + " mm", "in (0, 100] mm");
        }
        if (!(limit.turned_deg > 0 && limit.turned_deg <= 90)) {
            throw bad_value(name, number_text(limit.turned_deg) + " degrees", "in (0, 90] degrees");
        }
        if (objects[limit.first].mobility == Mobility::stays && objects[limit.second].mobility == Mobility::stays) {
            throw Error(name + ": neither moves");
        }
        for (std::size_t i = 0; i < j; ++i) {
            const bool is_same =
                std::minmax(limits[i].first, limits[i].second) == std::minmax(limit.first, limit.second);
            if (is_same) throw Error(name + ": has two limits");
        }
    }
}

/// True where a view shows something of an object at its start, which the X-rays then hold.
bool is_held(const SceneDescent& scene, std::size_t k) {
    return std::ranges::any_of(scene.views, [&](const View& view) {
        return seen_share(scene.volumes[k]->sample(), view, scene.starts_world_from_ct[k]) > 0;
    });
}

/// The limits as priors; where the starts are far beyond one, a decision says so. An object that no view shows pulls at
/// no other: where it is may be wrong by any distance.
void set_joints(SceneDescent& scene, std::span<const std::string> names, std::span<const JointLimit> limits,
                std::vector<std::string>& decisions) {
    for (const JointLimit& limit : limits) {
        const JointPrior& joint = scene.joints.emplace_back(make_joint_prior(
            limit, scene.volumes[limit.first]->sample(), scene.volumes[limit.second]->sample(), names));
        if (is_held(scene, limit.first) && is_held(scene, limit.second)) scene.pulling.push_back(joint);
        const JointMotion motion =
            joint_motion(joint, scene.starts_world_from_ct[limit.first], scene.starts_world_from_ct[limit.second]);
        if (motion.shift_mm.norm() <= limit.apart_mm) continue;
        decisions.push_back("joint of " + names[limit.first] + " and " + names[limit.second] +
                            ": the starts part them by " + fixed(motion.shift_mm.norm(), 1) + " mm, its limit is " +
                            fixed(limit.apart_mm, 1));
    }
}

/// Coarse levels of X-rays with much that is no object's can lead an object anywhere. Beyond where it is sought at all
/// its start is the better guess, and it no longer explains what others should. True where one was put back.
bool put_back_strays(SceneDescent& scene, std::span<const SceneObject> objects, std::vector<std::string>& decisions) {
    bool has_changed = false;
    for (const std::size_t k : scene.moving) {
        const double apart_mm = from_start_mm(scene, k, scene.world_from_ct[k]);
        if (objects[k].is_rest || apart_mm <= searched_mm(scene.options.search)) continue;
        decisions.push_back(objects[k].name + ": put back to its start, from which all together had led it " +
                            fixed(apart_mm, 1) + " mm away");
        scene.world_from_ct[k] = scene.starts_world_from_ct[k];
        has_changed = true;
    }
    return has_changed && !scene.stopped_by;
}

}  // namespace

SceneResult register_scene(std::span<const SceneObject> objects, std::span<const View> views,
                           const RegistrationOptions& options, Backend& backend, const RunControl& control,
                           std::span<const JointLimit> limits) {
    check_scene_options(objects, options, backend);
    check_limits(objects, limits);
    check_views(views);
    std::deque<ResidentVolume> resident;
    std::vector<ResidentVolume*> volumes;
    for (const SceneObject& object : objects) {
        volumes.push_back(&resident.emplace_back(object.volume, options.render, backend));
    }
    return register_resident_scene(objects, volumes, views, options, control, limits);
}

SceneResult register_resident_scene(std::span<const SceneObject> objects, std::span<ResidentVolume* const> volumes,
                                    std::span<const View> views, const RegistrationOptions& options,
                                    const RunControl& control, std::span<const JointLimit> limits) {
    const auto begin = Clock::now();
    check_scene_options(objects, options, volumes.front()->backend());
    check_limits(objects, limits);
    check_views(views);
    SceneDescent scene(views, options, control);
    scene.volumes.assign(volumes.begin(), volumes.end());
    for (std::size_t k = 0; k < objects.size(); ++k) {
        scene.starts_world_from_ct.push_back(objects[k].start_world_from_ct);
        if (objects[k].mobility == Mobility::moves) scene.moving.push_back(k);
        if (objects[k].mobility == Mobility::moves && !objects[k].is_rest) scene.guides.push_back(k);
        scene.has_rest = scene.has_rest || objects[k].is_rest;
    }
    if (scene.guides.empty()) scene.guides = scene.moving;
    scene.world_from_ct = scene.starts_world_from_ct;
    SceneResult result;
    std::vector<std::string> names;
    for (const SceneObject& object : objects) names.push_back(object.name);
    set_joints(scene, names, limits, result.decisions);
    descend_together(scene);
    if (put_back_strays(scene, objects, result.decisions)) finish_together(scene);
    result.together_s = seconds_since(begin);
    judge_all(scene, objects, result);
    const bool may_search = options.search.mode != Search::none;
    for (int round = 0; round < kRounds && may_search && !scene.stopped_by; ++round) {
        if (!take_better_places(scene, objects, result)) break;
        finish_together(scene);
        judge_all(scene, objects, result);
    }
    stay_with_the_scene(scene, objects, result);
    count_other_places(scene, result.objects);
    if (!scene.stopped_by) result.joints = settle_joints(scene, names, result.objects);
    result.joints.resize(limits.size());
    doubt_other_places(scene, objects, result.objects);
    doubt_far_places(scene, objects, result.objects);
    doubt_shared_places(objects, result.objects);
    trust_what_is_explained(scene, objects, result);
    result.together = scene.world_from_ct;
    result.cost_initial = scene.cost_initial;
    result.cost_final = scene.cost_final;
    result.iterations = scene.iterations;
    result.ok = true;
    for (RegistrationResult& object : result.objects) {
        if (scene.stopped_by && object.ok) object.reasons.push_back(*scene.stopped_by);
        object.ok = object.reasons.empty();
        result.ok = result.ok && object.ok;
    }
    result.total_s = seconds_since(begin);
    return result;
}

}  // namespace raylign::detail
