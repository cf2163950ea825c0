#include "core/validation/compare_scene.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/pyramid.h"
#include "raylign/targets.h"

namespace raylign::detail::validation {
namespace {

constexpr double kPoseTolerance_px = 0.005;  // at the object

}  // namespace

void check(const std::vector<NamedBackend>& backends, const CompareOptions& o) {
    if (backends.size() < 2) throw Error("compare: at least two backends are needed, the first is the oracle");
    if (o.poses < 1 || o.poses > 1000) throw bad_value("poses", std::to_string(o.poses), "in [1, 1000]");
    if (o.longest_side_px < 32 || o.longest_side_px > 4096) {
        throw bad_value("longest_side_px", std::to_string(o.longest_side_px), "in [32, 4096]");
    }
    if (!(o.spread_mm >= 0 && o.spread_mm <= 1000)) {
        throw bad_value("spread_mm", std::to_string(o.spread_mm), "in [0, 1000]");
    }
    if (o.registrations < 0 || o.registrations > 1000) {
        throw bad_value("registrations", std::to_string(o.registrations), "in [0, 1000]");
    }
}

std::vector<View> reduced(std::span<const View> views, int longest_side_px) {
    std::vector<View> small(views.begin(), views.end());
    for (View& view : small) {
        while (view.geometry.camera.size_px.maxCoeff() > longest_side_px) view = half_resolution(view);
    }
    return small;
}

std::vector<RigidTransform> random_poses(const RigidTransform& given, std::span<const Eigen::Vector3d> targets_ct_mm,
                                         int count, double spread_mm, std::uint64_t seed) {
    Random random(seed);
    std::vector<RigidTransform> poses;
    for (int i = 0; i < count; ++i) {
        // The given pose first: real data is looked at where it matters.
        const double mtre_mm = i == 0 ? 0 : random.uniform(0, spread_mm);
        poses.push_back(perturbed_start(given, targets_ct_mm, mtre_mm, random.bits()));
    }
    return poses;
}

Tolerance for_pixels(Tolerance tolerance, std::span<const View> views, const Eigen::Vector3d& object_world_mm) {
    for (const View& view : views) {
        const double depth_mm = (view.geometry.camera_from_world * object_world_mm).z();
        const double pixel_mm = depth_mm / view.geometry.camera.intrinsics_px(0, 0);
        if (!(kPoseTolerance_px * pixel_mm > tolerance.value)) continue;
        tolerance = {kPoseTolerance_px * pixel_mm,
                     "the optimizer stops within thousandths of a pixel, here " + std::to_string(pixel_mm) + " mm"};
    }
    return tolerance;
}

}  // namespace raylign::detail::validation
