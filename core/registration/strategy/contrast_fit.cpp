#include "core/registration/strategy/contrast_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/number_text.h"
#include "core/registration/trust/response.h"

namespace raylign::detail {
namespace {

constexpr int kRounds = 6;
constexpr double kMostFloor = 0.97;     // nearly exp(-I) itself: more changes nothing
constexpr double kLongestStep = 0.7;    // of what is left to 1
constexpr double kSettledFloor = 0.01;  // moves a vertebra by about 0.1 mm of depth

double next_floor(Run& run, Level& level, double floor) {
    const LevelProblem problem = level.problem(run.result.world_from_ct, false);
    const std::vector<ViewSums> sums =
        pose_sums(level.session(), run.result.world_from_ct, run.extent.centre_ct_mm, problem.before_batch,
                  [floor](const Image& shown, std::size_t) { return floor_derivative(shown, floor); });
    const double most = std::min(kMostFloor, floor + kLongestStep * (1 - floor));
    const double step = floor_step(sums.front());
    return std::isfinite(step) ? std::clamp(floor + step, 0.0, most) : floor;
}

}  // namespace

Twist fit_contrast(Run& run, Level& level) {
    if (std::isfinite(level.views().front().ceiling)) return Twist::Zero();
    const RigidTransform before = run.result.world_from_ct;
    double floor = 0;
    for (int round = 1; round <= kRounds; ++round) {
        const double next = next_floor(run, level, floor);
        const bool is_settled = std::abs(next - floor) < kSettledFloor;
        if (is_settled && round == 1) return Twist::Zero();
        floor = next;
        level.show_up_to(floor > 0 ? -std::log(floor) : std::numeric_limits<double>::infinity());
        level.settle(is_settled || round == kRounds);
        if (is_settled) break;
    }
    if (floor == 0) return Twist::Zero();
    run.result.decisions.push_back(
        "the X-ray compresses contrast, as scatter, glare and a black level do: DRRs are compared as -log(f + (1 - f) "
        "exp(-L)) with f = " +
        fixed(floor, 2) + ", fitted beside the pose");
    const Eigen::Vector3d centre_mm = before * run.extent.centre_ct_mm;
    return log(RigidTransform::translate(-centre_mm) * run.result.world_from_ct * inverse(before) *
               RigidTransform::translate(centre_mm));
}

}  // namespace raylign::detail
