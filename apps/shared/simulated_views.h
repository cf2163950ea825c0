#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/backend.h"

namespace raylign::detail::apps {

/// The cpu backend where this build has it: the same images whatever is studied.
[[nodiscard]] std::unique_ptr<Backend> simulation_backend();

struct SimulatedViews {
    std::vector<char> is_simulated;  ///< per view
    std::string how;                 ///< in words; "" where no view is simulated
};

/// Gives views without an image the X-ray of the volume at the true pose, without noise: by another projector than the
/// one that registers (trilinear with steps of 0.4 voxels, or joseph), on the full grid, so that the match is not exact
/// by construction. By the cpu backend where this build has it: the same images whatever is studied.
[[nodiscard]] SimulatedViews simulate_missing_images(const Volume& volume, std::vector<View>& views,
                                                     const RigidTransform& true_world_from_ct, Projector registers_by);

}  // namespace raylign::detail::apps
