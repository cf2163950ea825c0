#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backends/reference/reference_backend.h"
#include "raylign/phantom.h"

namespace raylign::detail {
namespace {

Image render(const Volume& volume, const ViewGeometry& geometry, Projector projector) {
    const View view{"test", geometry, {}, {}};
    return make_reference_backend()->prepare({volume, {&view, 1}, {projector, {}}, {}})->render({}, 0);
}

/// Centre of mass of an image [px].
Eigen::Vector2d centroid(const Image& image) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double mass = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            sum += image(x, y) * Eigen::Vector2d(x, y);
            mass += image(x, y);
        }
    }
    return sum / mass;
}

/// Anisotropic, with the first axis mirrored.
VoxelGrid lateral_grid() {
    VoxelGrid grid = centred_grid({12, 14, 10}, {3, 2.5, 4});
    grid.direction.col(0) *= -1;
    grid.origin_mm.x() *= -1;
    return grid;
}

CArm side(double primary_deg, double secondary_deg) {
    return {.sad_mm = 600,
            .sdd_mm = 900,
            .primary_angle_deg = primary_deg,
            .secondary_angle_deg = secondary_deg,
            .pixel_pitch_mm = {0.5, 0.6},
            .size_px = {160, 150},
            .principal_point_px = Eigen::Vector2d(81, 72.5)};
}

/// One bright voxel in each corner, seen from each side, with both projectors: its shadow's centre of mass is where its
/// centre projects. The hat is symmetric; perspective and the pixel grid shift the centroid by less than 0.1 px.
TEST(ReferenceOrientation, CornerVoxelLandsWhereItsCentreProjects) {
    constexpr double kAngles[][2] = {{0, 0}, {90, 0}, {-90, 0}, {180, 0}, {0, 90}, {0, -90}, {30, -20}};
    for (const auto& [primary_deg, secondary_deg] : kAngles) {
        for (int corner = 0; corner < 8; ++corner) {
            Volume volume{lateral_grid(), {}};
            volume.attenuation_per_mm.resize(volume.grid.voxel_count());
            const Eigen::Vector3i last = volume.grid.size - Eigen::Vector3i::Ones();
            const Eigen::Vector3i v(corner & 1 ? last.x() : 0, corner & 2 ? last.y() : 0, corner & 4 ? last.z() : 0);
            volume.attenuation_per_mm[volume.index(v.x(), v.y(), v.z())] = 1;
            const ViewGeometry view = view_from_c_arm(side(primary_deg, secondary_deg));
            const Eigen::Vector2d expected = project(view, volume.grid.ct_from_voxel(v.cast<double>()));
            for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
                const double error_px = (centroid(render(volume, view, projector)) - expected).norm();
                EXPECT_TRUE(error_px < 0.1) << error_px << " px at " << primary_deg << "/" << secondary_deg
                                            << " corner " << corner << " projector " << projector_name(projector);
            }
        }
    }
}

/// From the front, as CArm documents it: the patient's left on the image's left, the head on top.
TEST(ReferenceOrientation, FrontalViewShowsLeftOnTheLeftAndHeadOnTop) {
    const Phantom left{"left", {Ellipsoid{RigidTransform::translate({10, 0, 0}), {3, 3, 3}, 1}}};
    const Phantom head{"head", {Ellipsoid{RigidTransform::translate({0, 0, 10}), {3, 3, 3}, 1}}};
    const ViewGeometry view = view_from_c_arm(side(0, 0));
    EXPECT_LT(centroid(exact_drr(left, view, {})).x(), 81 - 20);
    EXPECT_LT(centroid(exact_drr(head, view, {})).y(), 72.5 - 20);
}

/// A detector inside the volume cuts the ray: what lies behind it does not count.
TEST(ReferenceOrientation, NothingBehindTheDetectorCounts) {
    Volume volume{centred_grid({3, 40, 3}, {1, 1, 1}), std::vector<float>(360, 0.01F)};
    ViewGeometry view = view_from_c_arm({.sad_mm = 600,
                                         .sdd_mm = 600,
                                         .primary_angle_deg = 0,
                                         .secondary_angle_deg = 0,
                                         .pixel_pitch_mm = {1, 1},
                                         .size_px = {1, 1},
                                         .principal_point_px = {}});
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        EXPECT_NEAR(render(volume, view, projector)(0, 0), 20 * 0.01, 1e-6);  // half of 40 voxels
    }
}

}  // namespace
}  // namespace raylign::detail
