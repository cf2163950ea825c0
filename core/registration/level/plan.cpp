#include "core/registration/level/plan.h"

#include <algorithm>
#include <cmath>

#include "core/image/pyramid.h"

namespace raylign::detail {
namespace {

constexpr int kSmallestImageSide_px = 32;
constexpr double kLeastThickness_px = 8;
constexpr int kFewestPixels = 400;       // 20 x 20: coarser, the mask's border decides
constexpr int kSmallestVolumeSide = 16;  // halving further leaves blobs that no longer look like the object

/// Size of a pixel projected to the depth of the object's centre [mm].
double pixel_at_object_mm(const ViewGeometry& view, const Eigen::Vector3d& centre_world_mm) {
    const double depth_mm = std::max((view.camera_from_world * centre_world_mm).z(), 1.0);
    return depth_mm / std::max(view.camera.intrinsics_px(0, 0), view.camera.intrinsics_px(1, 1));
}

/// Where the DRR saturates, voxels that are averaged move its outline outwards (the least of metal hides nearly all),
/// by a sixth of a pixel where they are as large as pixels: they are halved once less.
double voxels_per_pixel(std::span<const View> views) {
    return std::ranges::any_of(views, [](const View& view) { return std::isfinite(view.ceiling); }) ? 2 : 1;
}

int halvings_that_fit(const VoxelGrid& grid, double voxel_mm) {
    const double ratio = voxel_mm / grid.spacing_mm.minCoeff();
    int halvings = std::max(0, static_cast<int>(std::lround(std::log2(std::max(ratio, 1e-6)))));
    while (halvings > 0 && (grid.size.minCoeff() >> halvings) < kSmallestVolumeSide) --halvings;
    return halvings;
}

GradientFilter narrowed(const GradientFilter& finest, int coarser_by) {
    // Half as many pixels per level would keep the width in mm; below one pixel a Gaussian is no longer sampled well.
    GradientFilter filter = finest;
    filter.sigma_px = std::max(std::min(1.0, finest.sigma_px), finest.sigma_px / std::exp2(coarser_by));
    filter.radius_px = std::max(1, static_cast<int>(std::lround(finest.radius_px * filter.sigma_px / finest.sigma_px)));
    return filter;
}

/// True if on every view the mask, eroded by the filter, leaves enough pixels to compare.
bool masks_leave_enough(std::span<const View> views, const LevelPlan& plan) {
    for (std::size_t v = 0; v < views.size(); ++v) {
        if (views[v].weights.empty()) continue;
        View mask{views[v].name, views[v].geometry, {}, views[v].weights};
        for (int i = 0; i < plan.image_halvings[v]; ++i) mask = half_resolution(mask);
        const Image eroded = erode_weights(mask.weights, plan.filter.radius_px);
        if (std::ssize(eroded.pixels) - std::ranges::count(eroded.pixels, 0.F) < kFewestPixels) return false;
    }
    return true;
}

}  // namespace

std::vector<LevelPlan> plan_levels(const Volume& volume, std::span<const View> views,
                                   const RigidTransform& world_from_ct, const ObjectExtent& extent,
                                   const GradientFilter& finest_filter, std::optional<int> levels) {
    const Eigen::Vector3d centre_world_mm = world_from_ct * extent.centre_ct_mm;
    LevelPlan finest;
    finest.filter = finest_filter;
    finest.pixel_at_object_mm = 1e300;
    int smallest_side_px = 1 << 30;
    for (const View& view : views) {
        double pixel_mm = pixel_at_object_mm(view.geometry, centre_world_mm);
        int side_px = view.geometry.camera.size_px.minCoeff(), halvings = 0;
        while (pixel_mm < volume.grid.spacing_mm.minCoeff() / 2 && side_px / 2 >= kSmallestImageSide_px) {
            pixel_mm *= 2;
            side_px /= 2;
            ++halvings;
        }
        finest.image_halvings.push_back(halvings);
        finest.pixel_at_object_mm = std::min(finest.pixel_at_object_mm, pixel_mm);
        smallest_side_px = std::min(smallest_side_px, side_px);
    }
    const double per_pixel = voxels_per_pixel(views);
    // A surface is as fine as the pixels are; coarser levels make do with voxels, which are faster there.
    finest.volume_halvings = volume.surface ? 0 : halvings_that_fit(volume.grid, finest.pixel_at_object_mm / per_pixel);

    std::vector<LevelPlan> plan{finest};
    while ((smallest_side_px >>= 1) >= kSmallestImageSide_px && (!levels || std::ssize(plan) < *levels)) {
        if (extent.thickness_mm < kLeastThickness_px * 2 * plan.back().pixel_at_object_mm) break;
        LevelPlan next = plan.back();
        next.is_finest = false;
        for (int& halvings : next.image_halvings) ++halvings;
        next.pixel_at_object_mm *= 2;
        next.volume_halvings = halvings_that_fit(volume.grid, next.pixel_at_object_mm / per_pixel);
        next.filter = narrowed(finest_filter, static_cast<int>(plan.size()));
        if (!masks_leave_enough(views, next)) break;
        plan.push_back(next);
    }
    std::ranges::reverse(plan);
    return plan;
}

int volume_halvings_like(const std::vector<LevelPlan>& own, const LevelPlan& plan) {
    const auto distance = [&](const LevelPlan& level) {
        return std::abs(level.image_halvings.front() - plan.image_halvings.front());
    };
    return std::ranges::min_element(own, {}, distance)->volume_halvings;
}

std::vector<View> bare(std::span<const View> views) {
    std::vector<View> bare;
    for (const View& view : views) bare.push_back({view.name, view.geometry, {}, {}});
    return bare;
}

}  // namespace raylign::detail
