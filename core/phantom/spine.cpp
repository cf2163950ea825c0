#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "raylign/phantom.h"

// The anatomy is drawn, not measured: sizes of an adult thoracolumbar spine as atlases give them, rounded. Lengths in
// this file are mm of a vertebra of natural size; `scale` turns them into mm of the phantom.

namespace raylign {
using namespace detail;
namespace {

// Attenuation at about 70 keV [1/mm]; bone and discs on top of the soft tissue around them.
constexpr double kSoftPerMm = 0.0193;
constexpr double kDiscPerMm = 0.0012;
constexpr double kCancellousPerMm = 0.008;
constexpr double kCorticalPerMm = 0.02;
constexpr double kRibPerMm = 0.013;  // thin shell and marrow, averaged

constexpr double kPitchMm = 40;   // from vertebra to vertebra at natural size
constexpr double kWidthMm = 200;  // least extent across that a vertebra of natural size needs
constexpr double kBodyHalfHeightMm = 14;
constexpr int kMaxVertebrae = 64;  // bounds the work for absurdly long extents
constexpr int kRibSegments = 14;   // 8 degrees from one to the next: the gaps at the joints stay below 1 mm

/// A fixed irregular sequence in [-1, 1): the golden ratio's multiples are spread evenly and never repeat.
double wobble(int level, int feature) {
    const double turns = std::numbers::phi * (7 * level + 3 * feature + 1);
    return 2 * (turns - std::floor(turns)) - 1;
}

Eigen::Matrix3d turn(double x_rad, double y_rad, double z_rad) {
    return (Eigen::AngleAxisd(z_rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(y_rad, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(x_rad, Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
}

/// Layout of the whole spine.
struct Spine {
    Eigen::Vector3d extent_mm;
    int count;
    double pitch_mm;
    double scale;

    [[nodiscard]] double level_z_mm(double level) const { return (level - (count - 1) / 2.0) * pitch_mm; }

    /// The curve through the bodies' centres: an S-shaped scoliosis of +-4 mm, lordosis below and kyphosis above, and
    /// the spine's place in the back, 70 mm from the skin to the bodies' centres.
    [[nodiscard]] Eigen::Vector3d curve_ct(double level) const {
        const double phase = std::numbers::pi * (level_z_mm(level) / extent_mm.z() + 0.5);  // 0 below, pi on top
        const double x = 4 * std::sin(1.6 * phase + 0.4);
        const double y = -5 * std::sin(2 * phase - 0.3);
        return {scale * x, 0.49 * extent_mm.y() - scale * (72 - y), level_z_mm(level)};
    }

    /// Vertebra axes: z along the curve, turned about it as scoliosis does, each a little off.
    [[nodiscard]] RigidTransform ct_from_vertebra(int level) const {
        const Eigen::Vector3d along = (curve_ct(level + 0.5) - curve_ct(level - 0.5)).normalized();
        const Eigen::Matrix3d upright =
            Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), along).toRotationMatrix();
        const Eigen::Matrix3d own =
            turn(0.03 * wobble(level, 0), 0.03 * wobble(level, 1), 0.05 * std::sin(1.3 * level + 0.5));
        return {upright * own, curve_ct(level)};
    }
};

/// Adds solids given in mm of natural size, in the axes of one vertebra.
struct Maker {
    RigidTransform ct_from_vertebra;
    double scale;
    std::vector<Solid>& solids;

    [[nodiscard]] RigidTransform place(const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation) const {
        return ct_from_vertebra * RigidTransform{rotation, scale * position};
    }
    void ellipsoid(const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& radii,
                   double extra_per_mm) const {
        solids.push_back(Ellipsoid{place(position, rotation), scale * radii, extra_per_mm});
    }
    void cylinder(const Eigen::Vector3d& position, const Eigen::Matrix3d& rotation, const Eigen::Vector2d& radii,
                  double half_length, double extra_per_mm) const {
        solids.push_back(EllipticCylinder{place(position, rotation), scale * radii, scale * half_length, extra_per_mm});
    }
};

/// Body: cancellous bone in a cortical shell of 1.2 mm (a full cylinder and a hollowing one), waisted by wider end
/// plates.
void add_body(const Maker& make, double width, double half_height) {
    const Eigen::Matrix3d straight = Eigen::Matrix3d::Identity();
    const Eigen::Vector2d radii = width * Eigen::Vector2d(21, 15.5), shell(1.2, 1.2);
    make.cylinder({0, 0, 0}, straight, radii, half_height, kCorticalPerMm);
    make.cylinder({0, 0, 0}, straight, radii - shell, half_height - 1.5, kCancellousPerMm - kCorticalPerMm);
    for (const double side : {-1.0, 1.0}) {
        make.cylinder({0, 0, side * (half_height + 0.6)}, straight, radii + 2 * shell, 0.6, kCorticalPerMm);
        // The rim flares: rings of decreasing width below the end plate.
        make.cylinder({0, 0, side * (half_height - 1.5)}, straight, radii + 1.2 * shell, 1.5, 0.3 * kCorticalPerMm);
        make.cylinder({0, 0, side * (half_height - 4)}, straight, radii + 0.5 * shell, 1, 0.3 * kCorticalPerMm);
    }
}

/// Pedicles, laminae and facet joints of one side; side = +1 left, -1 right.
void add_arch(const Maker& make, double side, double width) {
    const Eigen::Matrix3d along_y = turn(std::numbers::pi / 2, 0, -0.12 * side);
    make.cylinder({12.5 * side * width, 20, 4.5}, along_y, {3.8, 6.5}, 7, kCorticalPerMm);
    make.cylinder({12.5 * side * width, 20, 4.5}, along_y, {2.4, 4.8}, 7, kCancellousPerMm - kCorticalPerMm);
    make.ellipsoid({7.5 * side, 31, -3}, turn(0.25, 0, -0.6 * side), {9.5, 2.6, 10}, 0.8 * kCorticalPerMm);
    make.ellipsoid({15 * side, 28, 14}, turn(-0.1, 0.15 * side, 0.5 * side), {3.6, 4.2, 8}, 0.9 * kCorticalPerMm);
    make.ellipsoid({12 * side, 32, -15}, turn(-0.1, 0.15 * side, 0.5 * side), {3.6, 3.6, 9}, 0.9 * kCorticalPerMm);
}

/// Transverse processes, each of its own length, and the spinous process, which is steeper in the thoracic part
/// (`height` 0 to 1).
void add_processes(const Maker& make, int level, double height) {
    for (const double side : {-1.0, 1.0}) {
        const double half_length = 14 + 2 * wobble(level, side > 0 ? 2 : 3) - 3 * height;
        make.ellipsoid({side * (13 + half_length), 25 + 4 * height, 4},
                       turn(0, -0.15 * side, side * (0.1 + 0.35 * height)), {half_length, 3.2, 5 - height},
                       0.8 * kCorticalPerMm);
    }
    const double tilt_rad = -0.2 - 0.5 * height;  // its tip hangs down
    make.ellipsoid({1.5 * wobble(level, 4), 34 + 13 * std::cos(tilt_rad), 13 * std::sin(tilt_rad) - 3},
                   turn(tilt_rad, 0, 0.05 * wobble(level, 5)), {3, 15, 8.5 - 2.5 * height}, 0.8 * kCorticalPerMm);
    make.ellipsoid({1.5 * wobble(level, 4), 34 + 25 * std::cos(tilt_rad), 25 * std::sin(tilt_rad) - 4},
                   turn(tilt_rad, 0, 0), {3.6, 3.5, 6}, 0.5 * kCorticalPerMm);
}

void add_vertebra(const Spine& spine, int level, std::vector<Solid>& solids) {
    const double height = spine.count > 1 ? level / (spine.count - 1.0) : 0.5;
    const Maker make{spine.ct_from_vertebra(level), spine.scale, solids};
    const double width = 1.07 - 0.22 * height + 0.03 * wobble(level, 6);  // smaller towards the head
    add_body(make, width, kBodyHalfHeightMm + 0.6 * wobble(level, 7));
    for (const double side : {-1.0, 1.0}) add_arch(make, side, width);
    add_processes(make, level, height);
}

/// A disc lies between two vertebrae, along the chord of the curve.
void add_disc(const Spine& spine, int below, std::vector<Solid>& solids) {
    const RigidTransform lower = spine.ct_from_vertebra(below), upper = spine.ct_from_vertebra(below + 1);
    const RigidTransform ct_from_disc{nearest_rotation(lower.rotation + upper.rotation),
                                      (lower.translation_mm + upper.translation_mm) / 2};
    const double half_gap_mm = spine.pitch_mm / 2 - spine.scale * (kBodyHalfHeightMm + 1.2);
    solids.push_back(
        EllipticCylinder{ct_from_disc, spine.scale * Eigen::Vector2d(21, 15.5), 0.9 * half_gap_mm, kDiscPerMm});
}

/// A straight piece of rib between two points: a flat cylinder, its broad side upright.
Solid rib_segment(const Eigen::Vector3d& from_ct, const Eigen::Vector3d& to_ct, double scale) {
    const Eigen::Vector3d along = (to_ct - from_ct).normalized();
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(along).normalized();
    Eigen::Matrix3d axes;
    axes << across, along.cross(across), along;
    return EllipticCylinder{
        {axes, (from_ct + to_ct) / 2}, scale * Eigen::Vector2d(3, 5.5), (to_ct - from_ct).norm() / 2, kRibPerMm};
}

/// A rib runs from the body's rear edge past the transverse process, then around the chest on an ellipse, sloping down.
/// `reach_rad` is where on the ellipse it ends: 0 = at the back, pi = at the sternum.
void add_rib(const Spine& spine, int level, double side, double reach_rad, std::vector<Solid>& solids) {
    constexpr double kLeavesBackRad = 0.62;
    const RigidTransform ct_from_vertebra = spine.ct_from_vertebra(level);
    const Eigen::Vector3d head_ct = ct_from_vertebra * (spine.scale * Eigen::Vector3d(20 * side, 13, 8));
    const Eigen::Vector3d neck_ct = ct_from_vertebra * (spine.scale * Eigen::Vector3d(35 * side, 26, 6));
    const Eigen::Vector2d chest_mm = Eigen::Vector2d(0.43, 0.42).cwiseProduct(spine.extent_mm.head<2>());
    const double slope_mm = spine.scale * (44 + 5 * wobble(level, side > 0 ? 8 : 9));  // between back and sternum
    Eigen::Vector3d from_ct = head_ct;
    for (int i = -1; i <= kRibSegments; ++i) {
        const double angle = kLeavesBackRad + (reach_rad - kLeavesBackRad) * i / kRibSegments;
        const double drop_mm = spine.scale * 5 + slope_mm * (1 - std::cos(angle - kLeavesBackRad)) / 1.5;
        const Eigen::Vector3d to_ct = i < 0 ? neck_ct
                                            : Eigen::Vector3d(side * chest_mm.x() * std::sin(angle),
                                                              chest_mm.y() * std::cos(angle), head_ct.z() - drop_mm);
        solids.push_back(rib_segment(from_ct, to_ct, spine.scale));
        from_ct = to_ct;
    }
}

/// Full ribs on the upper levels, a short one below them, as the twelfth is.
void add_ribs(const Spine& spine, std::vector<Solid>& solids) {
    const int first_full = (2 * spine.count + 4) / 5;
    for (int level = std::max(0, first_full - 1); level < spine.count; ++level) {
        const double reach_rad = level < first_full ? 1.1 : 2.45;
        for (const double side : {-1.0, 1.0}) {
            add_rib(spine, level, side, reach_rad + 0.08 * wobble(level, side > 0 ? 10 : 11), solids);
        }
    }
}

Spine layout(const Eigen::Vector3d& extent_mm) {
    if (!(extent_mm.allFinite() && extent_mm.minCoeff() > 0)) {
        throw bad_value("smallest side of the spine phantom's extent", std::to_string(extent_mm.minCoeff()) + " mm",
                        "positive and finite");
    }
    const double across = std::min(1.0, extent_mm.head<2>().minCoeff() / kWidthMm);
    const double levels = std::clamp(std::round(extent_mm.z() / (kPitchMm * across)), 1.0, double{kMaxVertebrae});
    // The rest is for the ends: tilted, with facets that stick out.
    const double pitch_mm = 0.95 * extent_mm.z() / levels;
    return {extent_mm, static_cast<int>(levels), pitch_mm, std::min(across, pitch_mm / kPitchMm)};
}

}  // namespace

Phantom spine_phantom(const Eigen::Vector3d& extent_mm) {
    const Spine spine = layout(extent_mm);
    Phantom phantom{"spine", {}};
    phantom.solids.push_back(EllipticCylinder{{}, 0.49 * extent_mm.head<2>(), 0.49 * extent_mm.z(), kSoftPerMm});
    for (int level = 0; level < spine.count; ++level) add_vertebra(spine, level, phantom.solids);
    for (int level = 0; level + 1 < spine.count; ++level) add_disc(spine, level, phantom.solids);
    add_ribs(spine, phantom.solids);
    return phantom;
}

Phantom spine_vertebra(const Eigen::Vector3d& extent_mm, int level) {
    const Spine spine = layout(extent_mm);
    if (level < 0 || level >= spine.count) {
        throw bad_value("vertebra", std::to_string(level), "in [0, " + std::to_string(spine.count - 1) + "]");
    }
    Phantom phantom{"vertebra", {}};
    add_vertebra(spine, level, phantom.solids);
    return phantom;
}

}  // namespace raylign
