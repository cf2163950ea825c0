#pragma once

#include <span>
#include <vector>

#include "core/registration/level/methods.h"
#include "core/registration/level/run.h"
#include "raylign/view.h"

namespace raylign::detail {

/// Poses around `centre`, itself first: turned about a random axis through the object's centre and shifted in a random
/// direction; turn and shift together move the rim by a distance (root of the squares' sum) uniform up to range_mm,
/// shared between them at random, the turn at most range_rad. Same seed, same poses on every machine.
[[nodiscard]] std::vector<RigidTransform> poses_near(const RigidTransform& centre, const ObjectExtent& extent,
                                                     double range_mm, double range_rad, int count, std::uint64_t seed);

/// Poses with the object's centre anywhere in the space that all views see, turned from `nominal` by a rotation vector
/// uniform in the ball of range_rad. The space: a cube about the nominal centre, of the widest view's field there,
/// without the points that any view does not show. Throws Error where hardly any point is seen by all views.
[[nodiscard]] std::vector<RigidTransform> poses_in_view(const RigidTransform& nominal, const ObjectExtent& extent,
                                                        std::span<const View> views, double range_rad, int count,
                                                        std::uint64_t seed);

/// Width of the widest view's field at the point's depth.
[[nodiscard]] double field_mm(std::span<const View> views, const Eigen::Vector3d& point_world_mm);

/// A place that searches ended at.
struct Candidate {
    RigidTransform world_from_ct;
    double cost = 0;
    int agreeing = 1;  ///< searches that ended there
};

/// Best first; candidates within `within_mm` of a better one are counted to it.
[[nodiscard]] std::vector<Candidate> distinct(std::vector<Candidate> candidates, const ObjectExtent& extent,
                                              double within_mm);

/// The `count` poses of least cost, best first. NaN costs are left out.
[[nodiscard]] std::vector<Candidate> best_of(const LevelProblem& problem, std::span<const RigidTransform> poses,
                                             std::size_t count);

/// Refines all candidates by Gauss-Newton at once.
[[nodiscard]] std::vector<Candidate> refined(const LevelProblem& problem, std::span<const Candidate> candidates);

/// Puts the candidates, best first, into the search report: how many ended at the best, and the rivals, which are at
/// least six pixels away from it.
void report_rivals(Run& run, const std::vector<Candidate>& candidates, double pixel_mm);

}  // namespace raylign::detail
