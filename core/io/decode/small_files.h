#pragma once

#include <filesystem>

#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// read(path), in a process of its own where there is one. Throws as `read` does, and where it dies.
[[nodiscard]] RigidTransform pose_in_own_process(const std::filesystem::path& path,
                                                 RigidTransform (*read)(const std::filesystem::path&));

/// Runs `read` in a process of its own and forgets what it gives: throws as it does, and where it dies. For small files
/// of which a library makes more than can be handed over: the caller, warned, reads them once more by itself.
void try_in_own_process(const std::filesystem::path& path, void (*read)(const std::filesystem::path&));

}  // namespace raylign::detail
