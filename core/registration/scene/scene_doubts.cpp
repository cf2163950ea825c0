#include "core/registration/scene/scene_doubts.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/number_text.h"
#include "core/registration/policy.h"
#include "core/registration/scene/collisions.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/trust/verdict.h"

namespace raylign::detail {
namespace {

constexpr double kSharedPlace = 0.5;  // of the larger one's volume: bones that touch share a layer of voxels

}  // namespace

double moved_mm(const SceneDescent& scene, std::size_t k, const RigidTransform& world_from_ct) {
    return apart_mm(world_from_ct, scene.world_from_ct[k], scene.volumes[k]->extent());
}

double elsewhere_mm(const SceneDescent& scene, std::size_t k, RigidTransform world_from_ct) {
    if (scene.views.size() == 1) {
        const Eigen::Vector3d centre_ct_mm = scene.volumes[k]->extent().centre_ct_mm;
        const Eigen::Vector3d centre_mm = scene.world_from_ct[k] * centre_ct_mm;
        const Eigen::Vector3d sight = (centre_mm - source_world_mm(scene.views.front().geometry)).normalized();
        world_from_ct.translation_mm -= sight.dot(world_from_ct * centre_ct_mm - centre_mm) * sight;
    }
    return moved_mm(scene, k, world_from_ct);
}

double from_start_mm(const SceneDescent& scene, std::size_t k, const RigidTransform& world_from_ct) {
    const Eigen::Vector3d centre_ct = scene.volumes[k]->extent().centre_ct_mm;
    return (world_from_ct * centre_ct - scene.starts_world_from_ct[k] * centre_ct).norm();
}

bool is_pulled(const SceneDescent& scene, std::size_t k) {
    return std::ranges::any_of(
        scene.pulling, [k](const JointPrior& joint) { return joint.limit.first == k || joint.limit.second == k; });
}

double searched_mm(const SearchOptions& search) {
    const bool is_near = search.mode == Search::automatic || search.mode == Search::near;
    return is_near ? search.range_mm.value_or(kNearRange_mm) : std::numeric_limits<double>::infinity();
}

void set_covariance(const SceneDescent& scene, std::size_t k, const Matrix6& covariance, RegistrationResult& object) {
    const ObjectExtent& extent = scene.volumes[k]->extent();
    object.confidence.covariance = (covariance + covariance.transpose()) / 2;
    summarise(object.confidence, extent.radius_mm);
    if (scene.views.size() == 1) {
        const Eigen::Vector3d centre_mm = object.world_from_ct * extent.centre_ct_mm;
        split_by_depth(object.confidence, (centre_mm - source_world_mm(scene.views.front().geometry)).normalized());
    }
    doubt_expected_error_anew(object);
}

void count_other_places(const SceneDescent& scene, std::vector<RegistrationResult>& results) {
    for (const std::size_t k : scene.moving) {
        RegistrationResult& object = results[k];
        if (is_pulled(scene, k) || !object.confidence.is_estimated) continue;
        const Eigen::Vector3d centre_mm = object.world_from_ct * scene.volumes[k]->extent().centre_ct_mm;
        const RigidTransform moved = scene.world_from_ct[k] * inverse(object.world_from_ct);
        const Twist apart = log(RigidTransform::translate(-centre_mm) * moved * RigidTransform::translate(centre_mm));
        set_covariance(scene, k, object.confidence.covariance + apart * apart.transpose(), object);
    }
}

void doubt_other_places(const SceneDescent& scene, std::span<const SceneObject> objects,
                        std::vector<RegistrationResult>& results) {
    for (std::size_t k = 0; k < objects.size(); ++k) {
        RegistrationResult& object = results[k];
        if (objects[k].mobility == Mobility::stays || object.levels.empty()) continue;
        const double apart = elsewhere_mm(scene, k, object.world_from_ct);
        if (apart < kSamePlace_mm) continue;
        object.reasons.push_back("all objects together fit better " + fixed(apart, 1) +
                                 " mm from where it fits best against what the others leave");
    }
}

void doubt_far_places(const SceneDescent& scene, std::span<const SceneObject> objects,
                      std::vector<RegistrationResult>& results) {
    const double range_mm = searched_mm(scene.options.search);
    for (std::size_t k = 0; k < objects.size(); ++k) {
        if (objects[k].mobility == Mobility::stays || objects[k].is_rest) continue;
        const double shift_mm = from_start_mm(scene, k, results[k].world_from_ct);
        if (shift_mm <= range_mm) continue;
        results[k].reasons.push_back("the result lies " + fixed(shift_mm, 1) + " mm from the start, beyond the " +
                                     fixed(range_mm, 0) + " mm that were searched");
    }
}

void doubt_shared_places(std::span<const SceneObject> objects, std::vector<RegistrationResult>& results) {
    std::vector<PosedVolume> posed;
    std::vector<std::size_t> positions;
    for (std::size_t k = 0; k < objects.size(); ++k) {
        if (objects[k].is_rest) continue;
        posed.push_back({&objects[k].volume, results[k].world_from_ct});
        positions.push_back(k);
    }
    for (const Collision& collision : collisions(posed)) {
        if (collision.share_of_larger < kSharedPlace) continue;
        for (const auto& [own, other] :
             {std::pair{collision.first, collision.second}, std::pair{collision.second, collision.first}}) {
            const std::size_t k = positions[own];
            if (objects[k].mobility == Mobility::stays) continue;
            results[k].reasons.push_back("it lies where " + objects[positions[other]].name +
                                         " does: " + fixed(100 * collision.share_of_larger, 0) +
                                         " % of the larger one's volume is in both: is one bone given twice?");
        }
    }
}

}  // namespace raylign::detail
