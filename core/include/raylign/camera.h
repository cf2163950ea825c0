#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "raylign/rigid_transform.h"

namespace raylign {

/// Pinhole camera. Source at the origin, x along image columns, y along rows (down), z towards the detector.
/// u = K x / z with K = `intrinsics_px` (upper triangular, K(2,2) = 1); integer pixel coordinates are pixel centres.
struct Camera {
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();  ///< columns, rows
    Eigen::Matrix3d intrinsics_px = Eigen::Matrix3d::Identity();
    std::optional<double> sdd_mm;  ///< source to detector; unknown for a bare K

    /// Pixel pitch at the detector [mm]: sdd / (fx, fy). Empty where sdd is unknown.
    [[nodiscard]] std::optional<Eigen::Vector2d> pixel_pitch_mm() const;
};

/// A camera and where it stands.
struct ViewGeometry {
    Camera camera;
    RigidTransform camera_from_world;
};

/// K = [[sdd / pitch_x, 0, cx], [0, sdd / pitch_y, cy], [0, 0, 1]].
[[nodiscard]] Camera camera_from_pitch(const Eigen::Vector2i& size_px, double sdd_mm,
                                       const Eigen::Vector2d& pixel_pitch_mm,
                                       const Eigen::Vector2d& principal_point_px);

/// Isocentric C-arm: the world's origin is the isocentre, its axes are patient LPS (x left, y posterior, z head) of a
/// supine patient. At angles 0/0 the source is posterior (+y, under the table), the detector anterior. The image is
/// what the detector sees from the source: columns run to the patient's RIGHT, rows to the feet. (A display that puts
/// the patient's left on the right side is mirrored against this.) A positive primary angle turns the detector to the
/// patient's left (LAO), a positive secondary angle to the head (CRA), as DICOM (0018,1510) and (0018,1511) say.
///   camera_from_world = T(0, 0, sad) * B * (R_z(primary) R_x(-secondary))^T
/// with the rows (-1,0,0), (0,0,-1), (0,-1,0) of B.
struct CArm {
    double sad_mm = 0;  ///< source to isocentre (axis)
    double sdd_mm = 0;
    double primary_angle_deg = 0;
    double secondary_angle_deg = 0;
    Eigen::Vector2d pixel_pitch_mm = Eigen::Vector2d::Zero();
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
    std::optional<Eigen::Vector2d> principal_point_px;  ///< default: the image's middle, (size - 1) / 2
};
[[nodiscard]] ViewGeometry view_from_c_arm(const CArm& c_arm);

/// Decomposes a 3x4 projection matrix P ~ K [R | t] (world mm to pixels, any scale and sign) by RQ.
/// Throws Error where the left 3x3 block is singular or the rotation would mirror after the sign is settled.
[[nodiscard]] ViewGeometry view_from_projection_matrix(const Eigen::Matrix<double, 3, 4>& pixel_from_world,
                                                       const Eigen::Vector2i& size_px, std::string_view where);

/// K [R | t], scaled so that its last row gives the depth z in mm.
[[nodiscard]] Eigen::Matrix<double, 3, 4> projection_matrix(const ViewGeometry& view);

/// Pixel coordinates of a world point; NaN where the point lies in the source's plane or behind it (z <= 0).
[[nodiscard]] Eigen::Vector2d project(const ViewGeometry& view, const Eigen::Vector3d& x_world);

[[nodiscard]] Eigen::Vector3d source_world_mm(const ViewGeometry& view);

/// Unit vector in world from the source through a pixel centre.
[[nodiscard]] Eigen::Vector3d ray_direction_world(const ViewGeometry& view, const Eigen::Vector2d& pixel);

}  // namespace raylign
