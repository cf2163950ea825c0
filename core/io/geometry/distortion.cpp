#include "core/io/geometry/distortion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/io/files/text.h"

namespace raylign {
using namespace detail;
namespace {

double radial_factor(const Distortion& d, double r2) {
    return (1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3))) / (1 + r2 * (d.k4 + r2 * (d.k5 + r2 * d.k6)));
}

Eigen::Vector2d distorted_ray(const Distortion& d, const Eigen::Vector2d& ray) {
    const double x = ray.x(), y = ray.y(), r2 = ray.squaredNorm(), f = radial_factor(d, r2);
    return {f * x + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x), f * y + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y};
}

Eigen::Vector2d ray_of(const Eigen::Matrix3d& camera_from_pixel, const Eigen::Vector2d& pixel) {
    return (camera_from_pixel.leftCols<2>() * pixel + camera_from_pixel.col(2)).head<2>();
}

Eigen::Vector2d pixel_of(const Camera& camera, const Eigen::Vector2d& ray) {
    return camera.intrinsics_px.topLeftCorner<2, 2>() * ray + camera.intrinsics_px.topRightCorner<2, 1>();
}

/// The radius up to which the model moves farther points farther out: beyond it folds back, and means nothing.
double radius_limit(const Distortion& d, double largest) {
    constexpr int kSteps = 2000;
    double last = 0;
    for (int i = 1; i <= kSteps; ++i) {
        const double r = largest * i / kSteps, moved = r * radial_factor(d, r * r);
        if (!(moved > last)) return largest * (i - 1) / kSteps;
        last = moved;
    }
    return std::numeric_limits<double>::infinity();
}

double corner_radius(const Camera& camera, const Eigen::Matrix3d& camera_from_pixel) {
    double largest = 0;
    for (const int x : {0, camera.size_px.x() - 1}) {
        for (const int y : {0, camera.size_px.y() - 1}) {
            largest = std::max(largest, ray_of(camera_from_pixel, Eigen::Vector2d(x, y)).norm());
        }
    }
    return largest;
}

}  // namespace

Eigen::Vector2d distorted_px(const Camera& camera, const Distortion& distortion, const Eigen::Vector2d& pixel) {
    return pixel_of(camera, distorted_ray(distortion, ray_of(inverse_of(camera.intrinsics_px), pixel)));
}

Eigen::Vector2d undistorted_px(const Camera& camera, const Distortion& distortion, const Eigen::Vector2d& pixel) {
    const Eigen::Vector2d target = ray_of(inverse_of(camera.intrinsics_px), pixel);
    Eigen::Vector2d ray = target;
    const double limit = radius_limit(distortion, std::max(1.0, 4 * target.norm()));
    constexpr int kMostSteps = 50;
    constexpr double kStep = 1e-6, kClose = 1e-12;  // of the ray's slopes, which are about 0.1
    for (int i = 0; i < kMostSteps; ++i) {
        const Eigen::Vector2d off = target - distorted_ray(distortion, ray);
        if (off.norm() < kClose && !(ray.norm() <= limit)) break;  // where the model folds back
        if (off.norm() < kClose) return pixel_of(camera, ray);
        Eigen::Matrix2d slope;
        for (int axis = 0; axis < 2; ++axis) {
            const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
            slope.col(axis) =
                (distorted_ray(distortion, ray + step) - distorted_ray(distortion, ray - step)) / (2 * kStep);
        }
        const double determinant = slope(0, 0) * slope(1, 1) - slope(0, 1) * slope(1, 0);
        if (!(determinant > 0)) break;
        ray.x() += (slope(1, 1) * off.x() - slope(0, 1) * off.y()) / determinant;
        ray.y() += (slope(0, 0) * off.y() - slope(1, 0) * off.x()) / determinant;
    }
    throw bad_value("point", "(" + number_text(pixel.x()) + ", " + number_text(pixel.y()) + ") px",
                    "where the camera's distortion (" + distortion_text(distortion) + ") shows anything");
}

namespace detail {

std::optional<Distortion> distortion_from(std::span<const double> coefficients, const std::string& what,
                                          const std::string& where) {
    const std::size_t count = coefficients.size();
    constexpr std::size_t kKnown = 8;
    if (count != 4 && count != 5 && count != 8 && count != 12 && count != 14) {
        throw bad_value("number of " + what, std::to_string(count), "4, 5 or 8 (k1, k2, p1, p2, k3, k4, k5, k6)",
                        where);
    }
    for (std::size_t i = kKnown; i < count; ++i) {
        if (coefficients[i] == 0) continue;
        throw Error(what + " in " + where +
                    " has thin prisms or a tilted sensor, which are not known here: undistort the images first");
    }
    std::array<double, kKnown> c{};
    std::ranges::copy(coefficients.first(std::min(count, kKnown)), c.begin());
    for (const double number : c) {
        if (!std::isfinite(number)) throw bad_value(what, number_text(number), "finite numbers", where);
    }
    if (std::ranges::count(c, 0.0) == std::ssize(c)) return std::nullopt;
    return Distortion{c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]};
}

Distortion flipped(Distortion distortion, ImageFlip flip) {
    if (flip == ImageFlip::columns) distortion.p2 = -distortion.p2;
    if (flip == ImageFlip::rows) distortion.p1 = -distortion.p1;
    return distortion;
}

std::string distortion_text(const Distortion& d) {
    std::string text = "k1 " + number_text(d.k1) + ", k2 " + number_text(d.k2) + ", p1 " + number_text(d.p1) + ", p2 " +
                       number_text(d.p2) + ", k3 " + number_text(d.k3);
    if (d.k4 != 0 || d.k5 != 0 || d.k6 != 0) {
        text += ", k4 " + number_text(d.k4) + ", k5 " + number_text(d.k5) + ", k6 " + number_text(d.k6);
    }
    return text;
}

PixelMap undistortion_map(const Camera& camera, const Distortion& distortion) {
    const Eigen::Matrix3d camera_from_pixel = inverse_of(camera.intrinsics_px);
    const double limit = radius_limit(distortion, corner_radius(camera, camera_from_pixel));
    const int width = camera.size_px.x(), height = camera.size_px.y();
    constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
    PixelMap map{Image(width, height, kNowhere), Image(width, height, kNowhere)};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Eigen::Vector2d ray = ray_of(camera_from_pixel, Eigen::Vector2d(x, y));
            if (!(ray.norm() <= limit)) continue;
            const Eigen::Vector2d pixel = pixel_of(camera, distorted_ray(distortion, ray));
            // Half a pixel beyond the outer centres is still seen; the map is float, as 1e-4 px do not matter.
            if (!(pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= width - 0.5 && pixel.y() <= height - 0.5))
                continue;
            map.x(x, y) = static_cast<float>(std::clamp(pixel.x(), 0.0, width - 1.0));
            map.y(x, y) = static_cast<float>(std::clamp(pixel.y(), 0.0, height - 1.0));
        }
    }
    return map;
}

namespace {

/// Calls body(pixel of the result, left column, top row, shares of the right column and the lower row).
template <typename Body>
void for_each_seen(const Image& image, const PixelMap& map, Body&& body) {
    for (std::size_t i = 0; i < map.x.pixels.size(); ++i) {
        const float x = map.x.pixels[i], y = map.y.pixels[i];
        if (std::isnan(x)) continue;
        const int left = std::clamp(static_cast<int>(x), 0, std::max(0, image.width - 2));
        const int top = std::clamp(static_cast<int>(y), 0, std::max(0, image.height - 2));
        body(i, left, top, x - static_cast<float>(left), y - static_cast<float>(top));
    }
}

}  // namespace

Image undistorted_image(const Image& image, const PixelMap& map) {
    if (image.empty()) return {};
    Image result(image.width, image.height, std::numeric_limits<float>::quiet_NaN());
    for_each_seen(image, map, [&](std::size_t i, int left, int top, float right_share, float lower_share) {
        const int right = right_share > 0 ? left + 1 : left, lower = lower_share > 0 ? top + 1 : top;
        const float upper_value = (1 - right_share) * image(left, top) + right_share * image(right, top);
        const float lower_value = (1 - right_share) * image(left, lower) + right_share * image(right, lower);
        result.pixels[i] = (1 - lower_share) * upper_value + lower_share * lower_value;
    });
    return result;
}

Image undistorted_mask(const Image& mask, const PixelMap& map) {
    if (mask.empty()) return {};
    Image result(mask.width, mask.height, 0);
    for_each_seen(mask, map, [&](std::size_t i, int left, int top, float right_share, float lower_share) {
        const int right = right_share > 0 ? left + 1 : left, lower = lower_share > 0 ? top + 1 : top;
        const bool is_used =
            mask(left, top) != 0 && mask(right, top) != 0 && mask(left, lower) != 0 && mask(right, lower) != 0;
        result.pixels[i] = is_used ? 1.0F : 0.0F;
    });
    return result;
}

void undistort(RawXray& xray, const PixelMap& map) {
    xray.image = undistorted_image(xray.image, map);
    xray.shutter = undistorted_mask(xray.shutter, map);
    xray.valid = undistorted_mask(xray.valid, map);
}

}  // namespace detail
}  // namespace raylign
