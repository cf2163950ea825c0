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

/// True where the DRR leaves so much of a view unexplained that the pose, or the image, must be wrong.
[[nodiscard]] bool is_weakly_explained(const RegistrationResult& result, std::size_t view);

/// True where that holds for any view, or for a part's views taken together.
[[nodiscard]] bool has_weak_view(const RegistrationResult& result);

/// Adds a reason where a CT whose cut sides hide a part of the X-rays explains the rest of them poorly. Only for
/// results that leave out what is hidden.
void doubt_beyond_the_cut(const RegistrationResult& result, std::vector<std::string>& reasons);

/// Says anew whether the expected error is too large, where it has changed since; other reasons stay.
void doubt_expected_error_anew(RegistrationResult& result);

/// Takes the expected error of a doubted pose back, unless that it is large is all that is wrong: then it is told.
void withhold_where_doubted(RegistrationResult& result);

}  // namespace raylign::detail
