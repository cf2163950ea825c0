#pragma once

#include <span>
#include <vector>

#include "core/base/linear_algebra.h"
#include "core/registration/scene/scene.h"
#include "core/registration/scene/scene_descent.h"

namespace raylign::detail {

// What a scene has against its objects' results beside what is held against each alone.

inline constexpr double kSamePlace_mm = 1;  ///< at the rim: ends closer than this are the same

/// How far the pose is from where all together ended, at the object's rim.
[[nodiscard]] double moved_mm(const SceneDescent& scene, std::size_t k, const RigidTransform& world_from_ct);
/// The same, with one view across its line of sight: depth is size there, which compressed contrast changes
/// (strategy/contrast_fit.h), and what both are apart by is expected as an error.
[[nodiscard]] double elsewhere_mm(const SceneDescent& scene, std::size_t k, RigidTransform world_from_ct);

/// How far the pose has the object's centre from where it started.
[[nodiscard]] double from_start_mm(const SceneDescent& scene, std::size_t k, const RigidTransform& world_from_ct);

/// How far from its start an object is sought; infinite where no search is, or one everywhere.
[[nodiscard]] double searched_mm(const SearchOptions& search);

/// True where a joint that takes part in the steps has the object at one end.
[[nodiscard]] bool is_pulled(const SceneDescent& scene, std::size_t k);

/// Takes the covariance over, with what follows from it and the verdict on it.
void set_covariance(const SceneDescent& scene, std::size_t k, const Matrix6& covariance, RegistrationResult& object);

/// Counts what an object's pose and the one that it has with all others are apart by as an error of it: each is found
/// from other pixels with other weights, and neither is known to be the better one. Not where a joint pulls at it: that
/// moves it with all others only.
void count_other_places(const SceneDescent& scene, std::vector<RegistrationResult>& results);

/// An object that ends elsewhere alone than with all others is not to be trusted.
void doubt_other_places(const SceneDescent& scene, std::span<const SceneObject> objects,
                        std::vector<RegistrationResult>& results);

/// An object whose centre lies farther from its start than searches around it reach was not compared with its
/// neighbours: of a spine it may be the wrong vertebra.
void doubt_far_places(const SceneDescent& scene, std::span<const SceneObject> objects,
                      std::vector<RegistrationResult>& results);

/// Two objects of about one size in one place: the sum of their DRRs explains what one bone shows.
void doubt_shared_places(std::span<const SceneObject> objects, std::vector<RegistrationResult>& results);

}  // namespace raylign::detail
