#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/registration/object/pose_space.h"
#include "raylign/result.h"
#include "raylign/view.h"

namespace raylign::detail {

/// Why not to trust a result, in words for people; empty = trust it. The bounds were set on trials with known truth
/// (bench/README.md, "Far starts, mismatch, verdict").
[[nodiscard]] std::vector<std::string> doubts(const RegistrationResult& result, std::span<const View> views,
                                              const RigidTransform& start, const ObjectExtent& extent);

}  // namespace raylign::detail
