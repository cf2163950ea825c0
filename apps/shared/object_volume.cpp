#include "apps/shared/object_volume.h"

#include <algorithm>
#include <optional>

#include "apps/shared/options.h"
#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

/// Voxels of a pixel move the outline of metal by a sixth of a pixel, and depth, which one view tells by size, by
/// 2 mm in a knee; half of a pixel leaves a third of that, but takes thrice the time (bench/README.md, knee).
constexpr double kVoxel_px = 2.0 / 3;

/// Side of a pixel at a point's depth [mm], the smallest of all views; none where it is behind a source.
std::optional<double> smallest_pixel_mm(std::span<const View> views, const Eigen::Vector3d& point_world) {
    std::optional<double> smallest;
    for (const View& view : views) {
        const double depth_mm = (view.geometry.camera_from_world * point_world).z();
        const Eigen::Matrix3d& k = view.geometry.camera.intrinsics_px;
        if (!(depth_mm > 0)) return std::nullopt;
        const double side_mm = depth_mm / std::max(k(0, 0), k(1, 1));
        smallest = std::min(smallest.value_or(side_mm), side_mm);
    }
    return smallest;
}

std::optional<double> proposed_spacing_mm(const VolumeFlags& flags, const VolumeReadOptions& options,
                                          std::span<const View> views,
                                          const std::function<RigidTransform(const VoxelGrid&)>& place) {
    VoxelGrid middle;
    middle.size.setOnes();
    middle.origin_mm = model_centre_mm(flags.file, options);
    try {
        const std::optional<double> pixel_mm = smallest_pixel_mm(views, place(middle) * middle.origin_mm);
        return pixel_mm ? std::optional(kVoxel_px * *pixel_mm) : std::nullopt;
    } catch (const Error&) {
        return std::nullopt;  // the caller meets the same fault when it asks for the start itself
    }
}

}  // namespace

std::string material_of(const std::vector<std::string>& materials, const std::string& object) {
    std::optional<std::string> own, common;
    for (const std::string& text : materials) {
        const bool is_common =
            text.find('=') == std::string::npos || text.starts_with("HU=") || text.starts_with("MU=");
        const bool is_own = !is_common && !object.empty() && text.starts_with(object + "=");
        if (!is_common && !is_own) continue;
        std::optional<std::string>& slot = is_own ? own : common;
        if (slot) throw Error("--material says twice what " + (is_own ? object : "the object") + " is made of");
        slot = is_own ? text.substr(object.size() + 1) : text;
    }
    return own ? *own : common.value_or("");
}

VolumeFile read_object_volume(const VolumeFlags& flags, std::span<const View> views,
                              const std::function<RigidTransform(const VoxelGrid&)>& place) {
    VolumeReadOptions options = volume_read_options(flags);
    if (is_model(flags.file) && !options.mesh_spacing_mm) {
        options.proposed_mesh_spacing_mm = proposed_spacing_mm(flags, options, views, place);
    }
    return read_volume(flags.file, options);
}

}  // namespace raylign::detail::apps
