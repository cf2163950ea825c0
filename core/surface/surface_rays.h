#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/surface/surface_drr.h"

namespace raylign::detail {

inline constexpr int kRaysAlong = 2;  ///< of a pixel's side
/// Place among the rays: those of pixel u are 2 u and 2 u + 1, a quarter of a pixel to each side of its centre.
[[nodiscard]] inline double ray_of_pixel(double u) { return kRaysAlong * u + (kRaysAlong - 1) / 2.0; }

[[nodiscard]] inline double pixel_of_ray(double x) { return (x - (kRaysAlong - 1) / 2.0) / kRaysAlong; }

/// The least whole number that is no less: std::ceil is a call where processors of any age are compiled for. Values
/// are at most 1e9 or so.
[[nodiscard]] inline int ceiling_of(double value) {
    const int whole = static_cast<int>(value);
    return whole + (value > whole ? 1 : 0);
}

struct SurfaceVertex {
    const SurfaceCorner* seen;
    const Eigen::Vector3d* voxel;
};

/// What rays have met, depths t [mm] counted from the projection's middle. With mu = attenuation, plus where a triangle
/// is left and minus where it is entered, n its normal and r the direction of the ray.
struct RaySums {
    Eigen::Array4f sums = Eigen::Array4f::Zero();     ///< sum mu n / n . r, sum mu t
    Eigen::Array4f moments = Eigen::Array4f::Zero();  ///< sum mu t n / n . r, sum mu t^2 / 2

    [[nodiscard]] float length() const { return sums[3]; }
    [[nodiscard]] float moment() const { return moments[3]; }
    [[nodiscard]] Eigen::Vector3d plane() const { return sums.head<3>().matrix().cast<double>(); }
    [[nodiscard]] Eigen::Vector3d plane_moment() const { return moments.head<3>().matrix().cast<double>(); }
};

/// The rays of some pixels and those next to them.
class SurfaceRays {
public:
    /// Of `size_px` pixels from `first_px` on. Without `is_full` only lengths are kept.
    SurfaceRays(const SurfaceProjection& seen, const RayFrame& frame, const Eigen::Vector2i& first_px,
                const Eigen::Vector2i& size_px, bool is_full);

    /// A triangle; each ray between its edges meets it, one on an edge belongs to one of the edge's two triangles.
    void add(const std::array<SurfaceVertex, 3>& vertices, double attenuation_per_mm);
    /// From sums to transmissions exp(-I).
    void finish(const Eigen::Vector3d& spacing_mm);

    [[nodiscard]] const Eigen::Vector2i& first_px() const { return first_px_; }
    [[nodiscard]] const Eigen::Vector2i& size_px() const { return size_px_; }
    [[nodiscard]] int width() const { return width_; }
    /// Of the first ray of the first pixel in this row of rays; rows and columns begin one ray before that.
    [[nodiscard]] std::size_t first_of_row(int row) const { return row_begin(row + 1) + 1; }
    [[nodiscard]] float transmission(std::size_t ray) const { return transmissions_[ray]; }
    [[nodiscard]] const RaySums& sums(std::size_t ray) const { return sums_[ray]; }

private:
    struct Facet;
    [[nodiscard]] Facet facet_of(const std::array<SurfaceVertex, 3>& vertices) const;
    void add_row(const Facet& facet, int row, int first, int end, double attenuation_per_mm);
    [[nodiscard]] std::size_t row_begin(int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    }
    [[nodiscard]] std::size_t place(int x, int y) const {
        return row_begin(y - y0_) + static_cast<std::size_t>(x - x0_);
    }

    const SurfaceProjection& seen_;
    const RayFrame& frame_;
    Eigen::Vector3d ray_voxel_, step_x_voxel_,
        step_y_voxel_;  ///< directions of rays: at (0, 0), and from one to the next
    Eigen::Vector2i first_px_, size_px_;
    int x0_, y0_, width_, height_;
    std::vector<RaySums> sums_;  ///< empty where only lengths are kept
    std::vector<float> lengths_, transmissions_;
};

}  // namespace raylign::detail
