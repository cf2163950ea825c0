#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>

#include "raylign/rigid_transform.h"

namespace raylign {

/// Three different axes, 0 = x, 1 = y, 2 = z.
struct CardanSequence {
    std::array<int, 3> axes{0, 1, 2};

    [[nodiscard]] std::string name() const;  ///< "XYZ"
    /// By any of XYZ, XZY, YXZ, YZX, ZXY and ZYX. Throws Error for other names.
    [[nodiscard]] static CardanSequence from_name(std::string_view name);
};

/// Angles (a, b, c) [rad] with R = R_i(a) R_j(b) R_k(c) for the sequence ijk: turns about the axis i of the proximal
/// body, the floating axis, and the axis k of the distal one. a and c lie in (-pi, pi], b in [-pi/2, pi/2]. With e the
/// parity of ijk (1 for xyz and its cyclic shifts, else -1):
///   sin b = e R_ik,  a = atan2(-e R_jk, R_kk),  c = atan2(-e R_ij, R_ii).
/// Where b is within 1e-7 of +-pi/2 only a combination of a and c is determined: then c = 0.
/// Source: [Grood83] (the joint coordinate system), for any axes; derived from the product.
[[nodiscard]] Eigen::Vector3d cardan_angles_rad(const Eigen::Matrix3d& proximal_from_distal,
                                                const CardanSequence& sequence);

/// The product of the three turns.
[[nodiscard]] Eigen::Matrix3d rotation_from_cardan(const Eigen::Vector3d& angles_rad, const CardanSequence& sequence);

/// A rigid motion as a turn about an axis and a shift along it.
struct HelicalAxis {
    double angle_rad = 0;                                 ///< in [0, pi]
    double shift_mm = 0;                                  ///< along `direction`
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit; of the shift where nothing turns; zero at rest
    Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();   ///< of the axis, nearest to the origin; zero without a turn
};

/// The finite helical (screw) axis of a motion x -> R x + t: n = rotation vector / angle, shift = n . t,
///   point = (t_across + cot(angle / 2) n x t_across) / 2 with t_across = t - shift n.
/// Below 1e-6 rad it counts as a shift: the axis would lie anywhere.
/// Source: [Spoor80], eq. 31-34 (with the point from the closed form).
[[nodiscard]] HelicalAxis helical_axis(const RigidTransform& motion);

}  // namespace raylign
