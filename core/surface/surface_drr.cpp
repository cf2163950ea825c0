#include "core/surface/surface_drr.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"
#include "core/surface/surface_pixels.h"
#include "core/surface/surface_rays.h"

namespace raylign::detail {
namespace {

constexpr int kBandRows_px = 16;
constexpr double kFar = 1e8;  // rays off the image: that far, any place is as good

struct Reach {
    double low, high;
};

Reach reach(double a, double b, double c) { return {std::min({a, b, c}), std::max({a, b, c})}; }

/// Whether a ray from first to last lies in [low, high).
bool meets_rays(const Reach& reach, int first, int last) {
    return std::max(ceiling_of(reach.low), first) < std::min(ceiling_of(reach.high), last + 1);
}

/// The pixel of the ray, or the one that is nearest to it within the image.
int pixel_at(double ray, int pixels) { return std::clamp((ceiling_of(ray + 1) - 1) / kRaysAlong, 0, pixels - 1); }

void check_surface(const Surface& surface) {
    const std::string where = "the surface";
    if (surface.triangles.empty()) throw Error(where + ": has no triangles");
    if (surface.attenuation_per_mm.size() != surface.triangles.size()) {
        throw bad_value("attenuations", std::to_string(surface.attenuation_per_mm.size()),
                        std::to_string(surface.triangles.size()) + ", one for each triangle", where);
    }
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        for (const std::int32_t corner : surface.triangles[i]) {
            if (corner >= 0 && static_cast<std::size_t>(corner) < surface.vertices_mm.size()) continue;
            throw bad_value("corner of triangle " + std::to_string(i), std::to_string(corner),
                            "one of the " + std::to_string(surface.vertices_mm.size()) + " vertices", where);
        }
        if (std::isfinite(surface.attenuation_per_mm[i])) continue;
        throw bad_value("attenuation of triangle " + std::to_string(i), number_text(surface.attenuation_per_mm[i]),
                        "finite", where);
    }
    for (std::size_t i = 0; i < surface.vertices_mm.size(); ++i) {
        if (!surface.vertices_mm[i].allFinite())
            throw Error(where + ": vertex " + std::to_string(i) + ": must be finite");
    }
}

}  // namespace

SurfaceDrr::SurfaceDrr(const Surface& surface, const VoxelGrid& grid)
    : triangles_(surface.triangles),
      attenuation_per_mm_(surface.attenuation_per_mm),
      spacing_mm_(grid.spacing_mm),
      handedness_(grid.direction.determinant() < 0 ? -1 : 1) {
    check_surface(surface);
    vertices_voxel_.reserve(surface.vertices_mm.size());
    Eigen::AlignedBox3d bounds;
    for (const Eigen::Vector3d& vertex : surface.vertices_mm) {
        vertices_voxel_.push_back(grid.voxel_from_ct(vertex));
        bounds.extend(vertices_voxel_.back());
    }
    middle_voxel_ = bounds.center();
}

SurfaceProjection SurfaceDrr::project(const RayFrame& frame, const Eigen::Vector2i& size_px) const {
    Eigen::Matrix3d voxel_from_pixel;
    voxel_from_pixel << frame.step_u_voxel, frame.step_v_voxel, frame.direction_voxel;
    SurfaceProjection seen;
    seen.size_px = size_px;
    seen.bands.resize(static_cast<std::size_t>((size_px.y() + kBandRows_px - 1) / kBandRows_px));
    seen.pixel_from_voxel = inverse_of(voxel_from_pixel);
    seen.leaving = voxel_from_pixel.determinant() < 0 ? -handedness_ : handedness_;
    seen.depth_mm = seen.pixel_from_voxel.row(2).dot(middle_voxel_ - frame.source_voxel);
    seen.corners.reserve(vertices_voxel_.size());
    for (const Eigen::Vector3d& vertex : vertices_voxel_) {
        const Eigen::Vector3d at = seen.pixel_from_voxel * (vertex - frame.source_voxel);
        if (!(at.z() > 0)) return seen;
        const auto ray = [&](double along) { return std::clamp(ray_of_pixel(along / at.z()), -kFar, kFar); };
        seen.corners.push_back({ray(at.x()), ray(at.y()), at.z()});
        seen.half_depth_mm = std::max(seen.half_depth_mm, std::abs(at.z() - seen.depth_mm));
    }
    sort_into_bands(seen);
    return seen;
}

void SurfaceDrr::sort_into_bands(SurfaceProjection& seen) const {
    const Eigen::Vector2i last = kRaysAlong * seen.size_px;  // one beyond the image
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const SurfaceCorner &a = seen.corners[static_cast<std::size_t>(triangles_[i][0])],
                            &b = seen.corners[static_cast<std::size_t>(triangles_[i][1])],
                            &c = seen.corners[static_cast<std::size_t>(triangles_[i][2])];
        const Reach x = reach(a.x, b.x, c.x), y = reach(a.y, b.y, c.y);
        if (!meets_rays(y, -1, last.y()) || !meets_rays(x, -1, last.x())) continue;
        const int begin = pixel_at(x.low - 1, seen.size_px.x()), end = pixel_at(x.high + 1, seen.size_px.x());
        const int bottom = pixel_at(y.high + 1, seen.size_px.y()) / kBandRows_px;
        for (int k = pixel_at(y.low - 1, seen.size_px.y()) / kBandRows_px; k <= bottom; ++k) {
            SurfaceProjection::Band& band = seen.bands[static_cast<std::size_t>(k)];
            band.begin_px = band.facets.empty() ? begin : std::min(band.begin_px, begin);
            band.end_px = std::max(band.end_px, end + 1);
            band.facets.push_back(static_cast<std::uint32_t>(i));
        }
    }
}

std::size_t SurfaceDrr::bytes() const {
    return vertices_voxel_.size() * sizeof(vertices_voxel_[0]) +
           triangles_.size() * (sizeof(triangles_[0]) + sizeof(attenuation_per_mm_[0]));
}

std::string SurfaceDrr::description() const { return std::to_string(triangles_.size()) + " triangles"; }

void SurfaceDrr::draw(const SurfaceProjection& seen, const RayFrame& frame, const RayFrameDerivatives* derivatives,
                      std::size_t band, const DrrTarget& target) const {
    const int first_px = static_cast<int>(band) * kBandRows_px;
    const int rows_px = std::min(kBandRows_px, seen.size_px.y() - first_px);
    const SurfaceProjection::Band& part = seen.bands[band];
    for (int image = 0; image < (derivatives ? 7 : 1); ++image) {
        for (int y = first_px; y < first_px + rows_px; ++y) {
            std::fill_n(target.image + image * target.distance + y * target.stride, seen.size_px.x(), 0.F);
        }
    }
    if (part.facets.empty()) return;
    SurfaceRays rays(seen, frame, Eigen::Vector2i(part.begin_px, first_px),
                     Eigen::Vector2i(part.end_px - part.begin_px, rows_px), derivatives != nullptr);
    for (const std::uint32_t i : part.facets) {
        std::array<SurfaceVertex, 3> vertices;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto vertex = static_cast<std::size_t>(triangles_[i][k]);
            vertices[k] = {&seen.corners[vertex], &vertices_voxel_[vertex]};
        }
        rays.add(vertices, static_cast<double>(attenuation_per_mm_[i]));
    }
    const SurfacePixels pixels{seen, frame, spacing_mm_, rays};
    rays.finish(spacing_mm_);
    derivatives ? pixels.draw(*derivatives, target) : pixels.draw(target);
}

}  // namespace raylign::detail
