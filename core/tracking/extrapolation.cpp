#include "core/tracking/extrapolation.h"

#include <algorithm>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

constexpr double kLongestStep = 3;   // frames between two poses that still tell a velocity
constexpr double kLongestReach = 2;  // frames

}  // namespace

RigidTransform extrapolate(std::span<const TimedPose> known, double time, const Eigen::Vector3d& centre_ct_mm) {
    if (known.empty()) throw Error("extrapolate: needs at least one pose");
    const TimedPose& last = known.back();
    if (known.size() == 1) return last.world_from_ct;
    const TimedPose& before = known[known.size() - 2];
    const double step = last.time - before.time;
    if (!(step > 0)) throw Error("extrapolate: times must increase");
    if (step > kLongestStep) return last.world_from_ct;
    const double gain = known.size() == 2 ? 0.5 : 1;
    const double reach = gain * std::clamp(time - last.time, 0.0, kLongestReach);

    const Eigen::Vector3d x_mm = last.world_from_ct * centre_ct_mm;
    const Eigen::Vector3d moved_mm = (reach / step) * (x_mm - before.world_from_ct * centre_ct_mm);
    Twist turn = Twist::Zero();
    turn.head<3>() = (reach / step) * log(last.world_from_ct * inverse(before.world_from_ct)).head<3>();
    return RigidTransform::translate(moved_mm) * exp_about(turn, x_mm) * last.world_from_ct;
}

}  // namespace raylign::detail
