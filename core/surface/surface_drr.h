#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/ray_frame.h"
#include "raylign/surface.h"

namespace raylign::detail {

/// Where the images of a frame are drawn: the DRR, and its six derivatives behind it.
struct DrrTarget {
    float* image;
    std::ptrdiff_t stride;    ///< floats from one row to the next
    std::ptrdiff_t distance;  ///< floats from one image to the next
};

/// A vertex as a frame sees it.
struct SurfaceCorner {
    double x, y;      ///< among the rays of the image: a ray is at whole numbers
    double depth_mm;  ///< along the camera's z axis
};

/// A surface as a frame sees it.
struct SurfaceProjection {
    struct Band {
        std::vector<std::uint32_t> facets;  ///< that rays of the band, or those next to it, can meet
        int begin_px = 0, end_px = 0;       ///< columns that they reach
    };
    Eigen::Vector2i size_px{0, 0};
    std::vector<SurfaceCorner> corners;  ///< per vertex
    std::vector<Band> bands;
    Eigen::Matrix3d pixel_from_voxel;        ///< depth (u, v, 1) of a point seen from the source
    double depth_mm = 0, half_depth_mm = 0;  ///< the middle, from which depths are counted, and how far any is from it
    double leaving = 1;                      ///< 1 where triangles that turn from x to y are left, -1 where entered
};

/// DRRs straight from a surface: along a ray, a body's length is the sum of the depths at which it is left less those
/// at which it is entered, in any order. Nothing is sorted and no voxel blurs an outline.
///
/// A pixel shows what reaches it on average, as a detector's does: of its 2 x 2 rays, with T the mean of exp(-I),
/// -log(f + (1 - f) T), f = exp(-ceiling). A ray that attenuates by more than 80 is shown as one of 80.
///
/// Derivatives have two terms. Rays meet planes n . y = n . p, whose depths t = n . (p - s) / n . r change by
/// -(n . ds + t n . dr) / n . r with the source s and the direction r: exact inside. Where an outline passes between
/// rays (a silhouette, a wall that rays run along) planes know nothing. What T changes by from ray to ray beyond what
/// the planes say moves with the point of the body at the depth of the edge, and that is where the paths of the two
/// rays differ: the difference of their first moments over that of their lengths.
class SurfaceDrr {
public:
    /// In the voxel coordinates of `grid`, as RayFrames are. Throws Error for no triangles, corners that are no vertex,
    /// what is not finite, and other than one attenuation a triangle.
    SurfaceDrr(const Surface& surface, const VoxelGrid& grid);

    /// Where it lies on an image. Nothing of a surface that reaches behind the source is seen: no X-ray shows one.
    [[nodiscard]] SurfaceProjection project(const RayFrame& frame, const Eigen::Vector2i& size_px) const;

    [[nodiscard]] std::size_t bytes() const;
    /// "32500 triangles".
    [[nodiscard]] std::string description() const;

    /// One band of rows; bands may be drawn in any order. `derivatives` may be null: then the DRR alone is.
    void draw(const SurfaceProjection& seen, const RayFrame& frame, const RayFrameDerivatives* derivatives,
              std::size_t band, const DrrTarget& target) const;

private:
    void sort_into_bands(SurfaceProjection& seen) const;

    std::vector<Eigen::Vector3d> vertices_voxel_;
    std::vector<std::array<std::int32_t, 3>> triangles_;
    std::vector<float> attenuation_per_mm_;
    Eigen::Vector3d spacing_mm_, middle_voxel_;
    double handedness_;  ///< -1 where the grid mirrors
};

}  // namespace raylign::detail
