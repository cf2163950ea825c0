#include "core/registration/object/cut_faces.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/ray_frame.h"

namespace raylign::detail {
namespace {

constexpr double kTissueShare = 0.5;  // of the mean of what attenuates
constexpr double kLeastFaceShare = 0.02;
constexpr double kMostTaken = 0.5;
constexpr double kFarAway_mm = 1e6;  // where a camera without sdd ends its rays

/// The face of the volume; none where too little of it is tissue.
std::vector<CutFace> face_of(const Volume& volume, int axis, bool is_high, double tissue_per_mm) {
    const Eigen::Vector3i& size = volume.grid.size;
    const int first = (axis + 1) % 3, second = (axis + 2) % 3;
    Eigen::Vector2i low(size[first], size[second]), high = Eigen::Vector2i::Constant(-1);
    long long tissue = 0;
    Eigen::Vector3i voxel;
    voxel[axis] = is_high ? size[axis] - 1 : 0;
    for (int b = 0; b < size[second]; ++b) {
        for (int a = 0; a < size[first]; ++a) {
            voxel[first] = a;
            voxel[second] = b;
            if (!(volume(voxel.x(), voxel.y(), voxel.z()) > tissue_per_mm)) continue;
            ++tissue;
            low = low.cwiseMin(Eigen::Vector2i(a, b));
            high = high.cwiseMax(Eigen::Vector2i(a, b));
        }
    }
    const double area = static_cast<double>(size[first]) * size[second];
    if (static_cast<double>(tissue) < kLeastFaceShare * area) return {};
    return {{axis, is_high, low.cast<double>(), high.cast<double>()}};
}

/// Narrows [near, far] to where from + t * by lies within [low, high].
void clip(double from, double by, double low, double high, double& near, double& far) {
    if (by == 0) {
        if (from < low || from > high) far = near - 1;
        return;
    }
    const double a = (low - from) / by, b = (high - from) / by;
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
}

bool meets(const CutFace& face, const VoxelGrid& grid, const Eigen::Vector3d& source, const Eigen::Vector3d& ray,
           double depth_mm) {
    constexpr double kEndless = 1e9;
    double near = 0, far = depth_mm;
    const double edge = face.is_high ? grid.size[face.axis] - 0.5 : -0.5;
    clip(source[face.axis], ray[face.axis], face.is_high ? edge : -kEndless, face.is_high ? kEndless : edge, near, far);
    for (int i = 0; i < 2; ++i) {
        const int axis = (face.axis + 1 + i) % 3;
        clip(source[axis], ray[axis], face.low_voxel[i] - 0.5, face.high_voxel[i] + 0.5, near, far);
    }
    return near < far;
}

/// The tissue of the face drawn through the volume.
bool meets_column(const CutFace& face, const VoxelGrid& grid, const Eigen::Vector3d& source, const Eigen::Vector3d& ray,
                  double depth_mm) {
    double near = 0, far = depth_mm;
    clip(source[face.axis], ray[face.axis], -0.5, grid.size[face.axis] - 0.5, near, far);
    for (int i = 0; i < 2; ++i) {
        const int axis = (face.axis + 1 + i) % 3;
        clip(source[axis], ray[axis], face.low_voxel[i] - 0.5, face.high_voxel[i] + 0.5, near, far);
    }
    return near < far;
}

}  // namespace

std::vector<CutFace> cut_faces(const Volume& volume) { return cut_faces(volume, volume_sums(volume)); }

std::vector<CutFace> cut_faces(const Volume& volume, const VolumeSums& sums) {
    const double tissue_per_mm = kTissueShare * sums.attenuating / std::max(1.0, sums.attenuating_count);
    std::vector<CutFace> faces;
    for (int axis = 0; axis < 3; ++axis) {
        for (const bool is_high : {false, true}) {
            const std::vector<CutFace> face = face_of(volume, axis, is_high, tissue_per_mm);
            faces.insert(faces.end(), face.begin(), face.end());
        }
    }
    return faces;
}

Image within_cut_faces(std::span<const CutFace> faces, const VoxelGrid& grid, const ViewGeometry& view,
                       const RigidTransform& world_from_ct) {
    const RayFrame frame = make_ray_frame(grid, view, world_from_ct);
    const double depth_mm = std::min(frame.depth_max_mm, kFarAway_mm);
    const int width = view.camera.size_px.x(), height = view.camera.size_px.y();
    Image within(width, height, 1);
    for (const CutFace& face : faces) {
        Image now = within;
        double reached = 0, taken = 0;
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const Eigen::Vector3d ray = frame.ray_voxel(x, y);
                const bool is_beyond = meets(face, grid, frame.source_voxel, ray, depth_mm);
                if (is_beyond) now(x, y) = 0;
                if (!meets_column(face, grid, frame.source_voxel, ray, depth_mm)) continue;
                ++reached;
                taken += is_beyond;
            }
        }
        if (taken <= kMostTaken * reached) within = std::move(now);
    }
    return within;
}

}  // namespace raylign::detail
