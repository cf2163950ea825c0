#pragma once

#include <span>

#include "core/registration/scene/scene.h"
#include "core/registration/scene/scene_descent.h"

namespace raylign::detail {

// Each object of a scene alone, as a part, against what the others leave of the X-rays.

/// Finishes and judges every object that moves.
void judge_all(SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result);

/// Takes over what objects found alone, elsewhere than all together, where the scene explains the X-rays better with
/// it; of those that are doubtful also what a search around their start finds. True where a pose has changed.
[[nodiscard]] bool take_better_places(SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result);

/// An object whose search ended where the scene explains less is where all together ended, and is judged there. What
/// the search found is held against it where that fits better alone.
void stay_with_the_scene(SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result);

/// Where all together explain nearly all, and an object little of what the others leave, that is more of their errors
/// than of the object: it is where all together ended. Its verdict and expected error stay.
void trust_what_is_explained(const SceneDescent& scene, std::span<const SceneObject> objects, SceneResult& result);

}  // namespace raylign::detail
