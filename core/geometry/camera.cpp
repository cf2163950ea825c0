#include "raylign/camera.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/geometry/camera.h"

namespace raylign {
using namespace detail;
namespace {

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

}  // namespace

std::optional<Eigen::Vector2d> Camera::pixel_pitch_mm() const {
    if (!sdd_mm) return std::nullopt;
    return Eigen::Vector2d(*sdd_mm / intrinsics_px(0, 0), *sdd_mm / intrinsics_px(1, 1));
}

Camera camera_from_pitch(const Eigen::Vector2i& size_px, double sdd_mm, const Eigen::Vector2d& pixel_pitch_mm,
                         const Eigen::Vector2d& principal_point_px) {
    Camera camera{size_px, Eigen::Matrix3d::Identity(), sdd_mm};
    camera.intrinsics_px(0, 0) = sdd_mm / pixel_pitch_mm.x();
    camera.intrinsics_px(1, 1) = sdd_mm / pixel_pitch_mm.y();
    camera.intrinsics_px.topRightCorner<2, 1>() = principal_point_px;
    return camera;
}

ViewGeometry view_from_c_arm(const CArm& c_arm) {
    const Eigen::Vector2d middle = (c_arm.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
    const double p = radians(c_arm.primary_angle_deg), s = radians(c_arm.secondary_angle_deg);
    // The detector starts anterior (-y). R_z(p) with p > 0 would carry -y to +x = left: (x, y) = (sin p, -cos p).
    Eigen::Matrix3d primary, secondary, base;
    primary << std::cos(p), -std::sin(p), 0, std::sin(p), std::cos(p), 0, 0, 0, 1;
    // R_x(-s) carries -y towards +z = head.
    secondary << 1, 0, 0, 0, std::cos(s), std::sin(s), 0, -std::sin(s), std::cos(s);
    base << -1, 0, 0, 0, 0, -1, 0, -1, 0;
    const Eigen::Matrix3d gantry = primary * secondary;
    return {
        camera_from_pitch(c_arm.size_px, c_arm.sdd_mm, c_arm.pixel_pitch_mm, c_arm.principal_point_px.value_or(middle)),
        {base * gantry.transpose(), Eigen::Vector3d(0, 0, c_arm.sad_mm)}};
}

ViewGeometry view_from_projection_matrix(const Eigen::Matrix<double, 3, 4>& pixel_from_world,
                                         const Eigen::Vector2i& size_px, std::string_view where) {
    Eigen::Matrix<double, 3, 4> p = pixel_from_world;
    const double row_norm = p.block<1, 3>(2, 0).norm();
    if (!p.allFinite() || row_norm == 0) {
        throw Error("projection_matrix in " + std::string(where) + ": must be finite with a non-zero third row");
    }
    p /= row_norm;  // the third row now measures depth in mm, up to its sign
    // det K > 0 and det R = +1, so the sign of P is the sign of its left determinant.
    const double determinant = determinant_of(p.leftCols<3>());
    if (std::abs(determinant) < 1e-9) {
        throw bad_value("determinant of projection_matrix", std::to_string(determinant), "non-zero", where);
    }
    if (determinant < 0) p = -p;
    const auto [r, q] = rq_factors(p.leftCols<3>());
    ViewGeometry view;
    view.camera.size_px = size_px;
    view.camera.intrinsics_px = r / r(2, 2);
    view.camera_from_world = {nearest_rotation(q), inverse_of(r) * p.col(3)};
    return view;
}

Eigen::Matrix<double, 3, 4> projection_matrix(const ViewGeometry& view) {
    Eigen::Matrix<double, 3, 4> extrinsics;
    extrinsics << view.camera_from_world.rotation, view.camera_from_world.translation_mm;
    return view.camera.intrinsics_px * extrinsics;
}

Eigen::Vector2d project(const ViewGeometry& view, const Eigen::Vector3d& x_world) {
    const Eigen::Vector3d x_camera = view.camera_from_world * x_world;
    if (!(x_camera.z() > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    return (view.camera.intrinsics_px * x_camera / x_camera.z()).head<2>();
}

Eigen::Vector3d source_world_mm(const ViewGeometry& view) { return inverse(view.camera_from_world).translation_mm; }

Eigen::Vector3d ray_direction_world(const ViewGeometry& view, const Eigen::Vector2d& pixel) {
    const Eigen::Matrix3d camera_from_pixel = inverse_of(view.camera.intrinsics_px);
    const Eigen::Vector3d direction_camera = camera_from_pixel.leftCols<2>() * pixel + camera_from_pixel.col(2);
    return (view.camera_from_world.rotation.transpose() * direction_camera).normalized();
}

Camera detail::finer(Camera camera, int n) {
    Eigen::Matrix3d& k = camera.intrinsics_px;
    k.topRows<2>() *= n;
    k.topRightCorner<2, 1>().array() += (n - 1) / 2.0;
    camera.size_px *= n;
    return camera;
}

Camera detail::half_resolution(const Camera& camera) {
    Eigen::Matrix3d half_from_full = Eigen::Matrix3d::Identity();
    half_from_full.topLeftCorner<2, 2>() /= 2;
    half_from_full.topRightCorner<2, 1>().setConstant(-0.25);
    return {camera.size_px / 2, half_from_full * camera.intrinsics_px, camera.sdd_mm};
}

void detail::check_camera(const Camera& camera, std::string_view where) {
    if (camera.size_px.minCoeff() < 1) {
        throw bad_value("size_px", std::to_string(camera.size_px.x()) + " x " + std::to_string(camera.size_px.y()),
                        "at least 1 x 1", where);
    }
    if (!camera.intrinsics_px.allFinite()) throw bad_value("intrinsics", "non-finite", "finite numbers", where);
    for (int axis = 0; axis < 2; ++axis) {
        const double focal_px = camera.intrinsics_px(axis, axis);
        if (!(focal_px > 0)) {
            throw bad_value(axis == 0 ? "focal length fx" : "focal length fy", std::to_string(focal_px) + " px",
                            "positive", where);
        }
    }
    if (camera.intrinsics_px.row(2) != Eigen::RowVector3d(0, 0, 1) || camera.intrinsics_px(1, 0) != 0) {
        throw Error("intrinsics in " + std::string(where) + ": must be upper triangular with last row 0 0 1");
    }
    if (camera.sdd_mm && !(*camera.sdd_mm > 0 && std::isfinite(*camera.sdd_mm))) {
        throw bad_value("sdd_mm", std::to_string(*camera.sdd_mm), "positive and finite", where);
    }
}

}  // namespace raylign
