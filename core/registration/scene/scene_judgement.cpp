#include "core/registration/scene/scene_judgement.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/registration/registration.h"
#include "core/registration/scene/remainder.h"
#include "core/registration/scene/scene_doubts.h"

namespace raylign::detail {
namespace {

// Where all together may have ended wrongly is a local minimum near the right place: other edges beside the object's
// own.
constexpr double kAround_mm = 15, kAround_deg = 30;

// Costs of all together, and then of an object, up to which no search looks for another place: what is explained
// nowhere else is not explained twice. Right places of bones whose surroundings are no objects have 0.25 and more.
constexpr double kSceneExplained = 0.15, kObjectExplained = 0.2;

/// What a search goes out from; nothing: the object stays about where all together ended.
enum class Around { nothing, the_scene, the_start };

/// How one object is registered alone: around where all together ended, or around its start.
RegistrationOptions alone(const RegistrationOptions& options, Around around) {
    RegistrationOptions one = options;
    one.content = Content::part;
    one.suspect_mirrored = false;  // of a part among others nothing else would be said
    one.rotation_centre_ct_mm.reset();
    if (around == Around::nothing) {
        one.search.mode = Search::none;
        one.levels = 1;
    }
    if (one.search.mode == Search::automatic) one.search.mode = Search::near;
    if (around == Around::the_scene && one.search.mode == Search::near) {
        one.search.range_mm = std::min(one.search.range_mm.value_or(kAround_mm), kAround_mm);
        one.search.range_deg = std::min(one.search.range_deg.value_or(kAround_deg), kAround_deg);
    }
    return one;
}

/// A result that says why there is none.
RegistrationResult not_judged(const SceneObject& object, const RigidTransform& world_from_ct, const std::string& why) {
    RegistrationResult result;
    result.world_from_ct = world_from_ct;
    result.start_world_from_ct = object.start_world_from_ct;
    result.content = Content::part;
    result.method = Method::gauss_newton;
    if (!why.empty()) result.reasons.push_back(why);
    result.ok = why.empty();
    return result;
}

/// An object against what the others leave of the X-rays.
RegistrationResult register_alone(SceneDescent& scene, std::size_t k, const SceneObject& object, Around around) {
    const RigidTransform& from = around == Around::the_start ? object.start_world_from_ct : scene.world_from_ct[k];
    try {
        RegistrationOptions options = alone(scene.options, around);
        if (object.is_rest) options.search.mode = Search::none;
        if (options.time_limit_s) options.time_limit_s = std::max(1e-3, *options.time_limit_s - elapsed_s(scene));
        RegistrationResult result = register_resident(*scene.volumes[k], remainder(scene.views, scene.shown, k), from,
                                                      options, {{}, scene.control.stop, scene.control.meanwhile});
        result.start_world_from_ct = object.start_world_from_ct;
        return result;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        return not_judged(object, scene.world_from_ct[k], error.what());
    }
}

/// True where a search that was called right has found an object where it is now: others have moved since, and it has
/// not, so that another search would find the same.
bool is_found_there(const SceneDescent& scene, std::size_t k, const RegistrationResult& before) {
    return before.ok && before.search.mode != Search::none && moved_mm(scene, k, before.world_from_ct) < kSamePlace_mm;
}

/// An object where all together ended: without a search where nearly all of the X-rays is explained, by all and by it,
/// or where one has found it already. `before`: the judgement before, or null.
RegistrationResult judged(SceneDescent& scene, std::size_t k, const SceneObject& object,
                          const RegistrationResult* before) {
    const bool is_sought = scene.options.search.mode == Search::automatic || scene.options.search.mode == Search::near;
    const bool is_found = before && is_found_there(scene, k, *before);
    if (is_found || (is_sought && scene.cost_final < kSceneExplained)) {
        RegistrationResult result = register_alone(scene, k, object, Around::nothing);
        if (is_found) result.search = before->search;
        if (result.ok && (is_found || result.cost_final < kObjectExplained)) return result;
    }
    return register_alone(scene, k, object, Around::the_scene);
}

/// From the centre of object a to that of b, in world, as the pose of a has it in the CT, and as both lie.
std::pair<Eigen::Vector3d, Eigen::Vector3d> from_to_mm(const SceneDescent& scene, std::size_t a, std::size_t b) {
    const Eigen::Vector3d &a_ct = scene.volumes[a]->extent().centre_ct_mm,
                          &b_ct = scene.volumes[b]->extent().centre_ct_mm;
    const RigidTransform &a_pose = scene.world_from_ct[a], &b_pose = scene.world_from_ct[b];
    return {a_pose.rotation * (b_ct - a_ct), b_pose * b_ct - a_pose * a_ct};
}

/// Of two objects that lie the other way round than in the CT each may have been found in the other's place, as one
/// vertebra in the next one's: no step and no search of one alone leads out of that. True where both have changed
/// places: the scene explains the X-rays better so.
bool put_back_in_order(SceneDescent& scene, std::span<const SceneObject> objects, std::vector<std::string>& decisions) {
    bool has_changed = false;
    for (const std::size_t a : scene.moving) {
        for (const std::size_t b : scene.moving) {
            if (b <= a || objects[a].is_rest || objects[b].is_rest) continue;
            const auto [in_the_ct_mm, now_mm] = from_to_mm(scene, a, b);
            if (in_the_ct_mm.dot(now_mm) >= 0) continue;
            SceneDescent exchanged = scene;
            exchanged.world_from_ct[a] = RigidTransform::translate(now_mm) * scene.world_from_ct[a];
            exchanged.world_from_ct[b] = RigidTransform::translate(-now_mm) * scene.world_from_ct[b];
            descend_together(exchanged);
            if (!try_poses(scene, exchanged.world_from_ct)) continue;
            decisions.push_back(objects[a].name + " and " + objects[b].name + ": have changed places");
            has_changed = true;
        }
    }
    return has_changed;
}

}  // namespace

void judge_all(SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result) {
    const std::vector<RegistrationResult> before = std::exchange(result.objects, {});
    for (std::size_t k = 0; k < objects.size(); ++k) {
        show_scene_progress(scene, k + 1 == objects.size() ? 1 : 0.5 + 0.5 * k / objects.size());
        if (objects[k].mobility == Mobility::stays) {
            result.objects.push_back(not_judged(objects[k], scene.world_from_ct[k], {}));
        } else {
            result.objects.push_back(judged(scene, k, objects[k], k < before.size() ? &before[k] : nullptr));
        }
    }
}

bool take_better_places(SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result) {
    std::vector<std::size_t> taken;
    const auto take = [&](std::size_t k, const RegistrationResult& found) {
        if (found.levels.empty() || moved_mm(scene, k, found.world_from_ct) < kSamePlace_mm) return;
        std::vector<RigidTransform> poses = scene.world_from_ct;
        poses[k] = found.world_from_ct;
        if (!try_poses(scene, poses)) return;
        show_anew(scene, k);
        result.decisions.push_back(objects[k].name + ": moved by a search against what the others leave unexplained");
        taken.push_back(k);
    };
    std::vector<std::size_t> sought = scene.moving;
    std::erase_if(sought, [&](std::size_t k) { return objects[k].is_rest; });
    for (const std::size_t k : sought) take(k, result.objects[k]);
    // All together may have led an object away from where it is, and its search with it.
    for (const std::size_t k : sought) {
        if (!result.objects[k].ok) take(k, register_alone(scene, k, objects[k], Around::the_start));
    }
    // What was said of the place before says nothing of the new one.
    for (const std::size_t k : taken) result.objects[k].ok = false;
    return put_back_in_order(scene, objects, result.decisions) || !taken.empty();
}

void stay_with_the_scene(SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result) {
    for (std::size_t k = 0; k < objects.size() && !scene.stopped_by; ++k) {
        RegistrationResult& searched = result.objects[k];
        if (objects[k].mobility == Mobility::stays || objects[k].is_rest || searched.levels.empty()) continue;
        const double apart_mm = elsewhere_mm(scene, k, searched.world_from_ct);
        if (apart_mm < kSamePlace_mm || searched.search.mode == Search::none) continue;
        RegistrationResult stayed = register_alone(scene, k, objects[k], Around::nothing);
        if (stayed.levels.empty()) continue;
        if (searched.cost_final < searched.cost_initial) {
            stayed.reasons.push_back("alone it fits better " + fixed(apart_mm, 1) +
                                     " mm from where all objects together explain most");
        }
        searched = std::move(stayed);
    }
}

void trust_what_is_explained(const SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result) {
    if (!(scene.cost_final < kSceneExplained)) return;
    for (const std::size_t k : scene.moving) {
        RegistrationResult& object = result.objects[k];
        if (objects[k].is_rest || is_pulled(scene, k) || !(object.cost_final > kObjectExplained)) continue;
        object.world_from_ct = scene.world_from_ct[k];
    }
}

}  // namespace raylign::detail
