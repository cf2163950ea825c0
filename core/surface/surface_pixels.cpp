#include "core/surface/surface_pixels.h"

#include <algorithm>
#include <cmath>

namespace raylign::detail {
namespace {

constexpr int kRays = kRaysAlong * kRaysAlong;

/// Calls use(x, y, first ray of the upper row, first ray of the lower row) for each pixel.
template <class Use>
void for_each_pixel(const SurfaceRays& rays, const Use& use) {
    for (int y = 0; y < rays.size_px().y(); ++y) {
        std::size_t upper = rays.first_of_row(kRaysAlong * y), lower = upper + static_cast<std::size_t>(rays.width());
        for (int x = 0; x < rays.size_px().x(); ++x, upper += kRaysAlong, lower += kRaysAlong) {
            use(rays.first_px().x() + x, rays.first_px().y() + y, upper, lower);
        }
    }
}

/// How a transmission changes: change . ds + moment . dr, of the rays' source and direction.
struct Change {
    Eigen::Vector3d source = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();
};

/// Mean over the pixel's rays of what planes say.
Change of_planes(const SurfacePixels& pixels, double length_mm, std::size_t upper, std::size_t lower) {
    Change change;
    for (const std::size_t ray : {upper, upper + 1, lower, lower + 1}) {
        const RaySums& sums = pixels.rays.sums(ray);
        const double scale = static_cast<double>(pixels.rays.transmission(ray)) * length_mm / kRays;
        const Eigen::Vector3d plane = sums.plane();
        change.source += scale * plane;
        change.direction += scale * (sums.plane_moment() + pixels.seen.depth_mm * plane);
    }
    return change;
}

/// Where edges between rays next to each other are, in mm from the middle.
class EdgeDepth {
public:
    /// Of the pixel's rays and those around them.
    EdgeDepth(const SurfaceRays& rays, std::size_t upper, std::size_t lower) {
        const auto below = static_cast<std::size_t>(rays.width());
        for (const std::size_t row : {upper, lower}) {
            for (const std::size_t ray : {row - 1, row, row + 1}) between(rays, ray, ray + 1);
        }
        for (const std::size_t column : {upper, upper + 1}) {
            for (const std::size_t ray : {column - below, column, column + below}) between(rays, ray, ray + below);
        }
    }
    [[nodiscard]] bool is_known() const { return weight_ > 0; }
    [[nodiscard]] double mm(double most_mm) const { return std::clamp(sum_ / weight_, -most_mm, most_mm); }

private:
    void between(const SurfaceRays& rays, std::size_t a, std::size_t b) {
        const double step =
            std::abs(static_cast<double>(rays.transmission(a)) - static_cast<double>(rays.transmission(b)));
        const double length = static_cast<double>(rays.sums(a).length()) - static_cast<double>(rays.sums(b).length());
        if (!(step > 0) || length == 0) return;
        const double moment = static_cast<double>(rays.sums(a).moment()) - static_cast<double>(rays.sums(b).moment());
        sum_ += step * moment / length;
        weight_ += step;
    }

    double sum_ = 0, weight_ = 0;
};

/// What arrives at a pixel, and at it shifted by half of its side to all sides: the rays that it would have there.
struct Arriving {
    Arriving(const SurfaceRays& rays, std::size_t upper, std::size_t lower) {
        const auto at = [&rays](std::size_t ray) { return static_cast<double>(rays.transmission(ray)); };
        const auto of_four = [&at](std::size_t a, std::size_t b) {
            return (at(a) + at(a + 1) + at(b) + at(b + 1)) / kRays;
        };
        const auto below = static_cast<std::size_t>(rays.width());
        here = of_four(upper, lower);
        left = of_four(upper - 1, lower - 1);
        right = of_four(upper + 1, lower + 1);
        up = of_four(upper - below, upper);
        down = of_four(lower, lower + below);
    }
    double here, left, right, up, down;

    [[nodiscard]] bool is_air() const { return here == 1 && left == 1 && right == 1 && up == 1 && down == 1; }
};

/// What takes the pixel from one transmission to another, as a change of transmission where it is: what it shows
/// follows the logarithm, which is not straight across an outline.
double slope(double from, double to, double floor, double scale) {
    constexpr double kStraight = 0.01;
    if (std::abs(scale * (to - from)) < kStraight) return to - from;
    return std::log((floor + (1 - floor) * from) / (floor + (1 - floor) * to)) / scale;
}

}  // namespace

void SurfacePixels::draw(const DrrTarget& target) const {
    const float floor = std::exp(-static_cast<float>(frame.ceiling));
    for_each_pixel(rays, [&](int x, int y, std::size_t upper, std::size_t lower) {
        const float arriving = (rays.transmission(upper) + rays.transmission(upper + 1) + rays.transmission(lower) +
                                rays.transmission(lower + 1)) /
                               kRays;
        if (arriving < 1) target.image[y * target.stride + x] = -std::log(floor + (1 - floor) * arriving);
    });
}

void SurfacePixels::draw(const RayFrameDerivatives& derivatives, const DrrTarget& target) const {
    draw(target);
    const double floor = std::exp(-frame.ceiling);
    const Eigen::RowVector3d along_u = seen.pixel_from_voxel.row(0), along_v = seen.pixel_from_voxel.row(1),
                             along_depth = seen.pixel_from_voxel.row(2);
    for_each_pixel(rays, [&](int x, int y, std::size_t upper, std::size_t lower) {
        const Arriving arriving(rays, upper, lower);
        if (arriving.is_air()) return;
        const double scale = -(1 - floor) / (floor + (1 - floor) * arriving.here);
        Change change = of_planes(*this, spacing_mm.cwiseProduct(frame.ray_voxel(x, y)).norm(), upper, lower);
        if (const EdgeDepth edge(rays, upper, lower); edge.is_known()) {
            const double depth_mm = seen.depth_mm + edge.mm(seen.half_depth_mm);
            const double rest_u =
                slope(arriving.left, arriving.right, floor, scale) - change.direction.dot(frame.step_u_voxel);
            const double rest_v =
                slope(arriving.up, arriving.down, floor, scale) - change.direction.dot(frame.step_v_voxel);
            const Eigen::Vector3d jump =
                (rest_u * (along_u - x * along_depth) + rest_v * (along_v - y * along_depth)).transpose() / depth_mm;
            change.source += jump;
            change.direction += depth_mm * jump;
        }
        for (std::size_t p = 0; p < derivatives.size(); ++p) {
            const double moved =
                change.source.dot(derivatives[p].source_voxel) + change.direction.dot(derivatives[p].ray_voxel(x, y));
            target.image[static_cast<std::ptrdiff_t>(p + 1) * target.distance + y * target.stride + x] =
                static_cast<float>(scale * moved);
        }
    });
}

}  // namespace raylign::detail
