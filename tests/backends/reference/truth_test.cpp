#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "backends/reference/reference_backend.h"
#include "core/base/random.h"
#include "raylign/phantom.h"

namespace raylign::detail {
namespace {

constexpr double kFloatPixel = 1.2e-7;  // relative rounding of a float pixel, 2^-23

Image render(const Volume& volume, const ViewGeometry& geometry, const RigidTransform& world_from_ct,
             const RenderSettings& settings) {
    const View view{"test", geometry, {}, {}};
    return make_reference_backend()->prepare({volume, {&view, 1}, settings, {}})->render(world_from_ct, 0);
}

// ---- A row of n voxels integrates to n s v ----

/// A grid away from every convenience: rotated, shifted, anisotropic, mirrored if `mirror` is -1.
VoxelGrid odd_grid(const Eigen::Vector3i& size, double mirror) {
    VoxelGrid grid;
    grid.size = size;
    grid.spacing_mm = {0.8, 1.25, 2.2};
    grid.origin_mm = {-13, 42, 7};
    grid.direction = exp((Twist() << 0.4, -0.9, 0.3, 0, 0, 0).finished()).rotation;
    grid.direction.col(2) *= mirror;
    return grid;
}

/// One pixel whose ray passes a ct point along a ct direction, the source `sad` before the point.
ViewGeometry pencil(const Eigen::Vector3d& x_ct, const Eigen::Vector3d& direction_ct,
                    const RigidTransform& world_from_ct) {
    ViewGeometry view;
    view.camera = camera_from_pitch({1, 1}, 2000, {0.5, 0.5}, {0, 0});
    const Eigen::Vector3d z = world_from_ct.rotation * direction_ct, x = z.unitOrthogonal();
    view.camera_from_world.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    view.camera_from_world.translation_mm =
        Eigen::Vector3d(0, 0, 1000) - view.camera_from_world.rotation * (world_from_ct * x_ct);
    return view;
}

struct RowCase {
    int axis;
    double sign, mirror, offset_voxel;
    Projector projector;
};

void expect_row_integral(const RowCase& c) {
    constexpr int kCount = 9;
    constexpr double kValue = 0.03;
    Eigen::Vector3i size(5, 6, 7), middle(2, 3, 3);
    size[c.axis] = kCount;
    Volume volume{odd_grid(size, c.mirror), {}};
    volume.attenuation_per_mm.resize(volume.grid.voxel_count());
    for (int i = 0; i < kCount; ++i) {
        middle[c.axis] = i;
        volume.attenuation_per_mm[volume.index(middle.x(), middle.y(), middle.z())] = static_cast<float>(kValue);
    }
    Eigen::Vector3d through_voxel = middle.cast<double>();
    through_voxel[(c.axis + 1) % 3] += c.offset_voxel;
    const Eigen::Vector3d direction_ct = c.sign * volume.grid.direction.col(c.axis);
    const RigidTransform world_from_ct = exp((Twist() << 0.3, 0.2, -0.6, 15, -9, 4).finished());
    const double spacing_mm = volume.grid.spacing_mm[c.axis];
    // A step that divides the spacing: the samples of each voxel's hat then add up to 1 wherever they start.
    const Image drr =
        render(volume, pencil(volume.grid.ct_from_voxel(through_voxel), direction_ct, world_from_ct), world_from_ct,
               {c.projector, c.projector == Projector::joseph ? std::nullopt : std::optional(spacing_mm / 4)});
    const double expected = kCount * spacing_mm * kValue * (1 - std::abs(c.offset_voxel));
    EXPECT_NEAR(drr(0, 0), expected, 2 * kFloatPixel * expected)
        << "axis " << c.axis << " sign " << c.sign << " mirror " << c.mirror << " offset " << c.offset_voxel;
}

TEST(ReferenceTruth, RowIntegratesToCountTimesSpacingTimesValue) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const double sign : {-1.0, 1.0}) {
                for (const double mirror : {-1.0, 1.0}) {
                    for (const double offset : {0.0, 0.3, -0.75})
                        expect_row_integral({axis, sign, mirror, offset, projector});
                }
            }
        }
    }
}

// ---- DRRs converge to the exact ones ----

ViewGeometry small_view() {
    return view_from_c_arm({.sad_mm = 500,
                            .sdd_mm = 800,
                            .primary_angle_deg = 0,
                            .secondary_angle_deg = 0,
                            .pixel_pitch_mm = {2.9, 2.9},
                            .size_px = {48, 48},
                            .principal_point_px = {}});
}

RigidTransform oblique_pose() { return exp((Twist() << 0.35, -0.5, 0.25, 3.7, -2.9, 4.3).finished()); }

/// `n` voxels over 100 mm in x; anisotropic.
VoxelGrid grid_of(int n) {
    const Eigen::Vector3i size(n, n * 4 / 5, n * 5 / 4);
    return centred_grid(size, Eigen::Vector3d::Constant(100).cwiseQuotient(size.cast<double>()));
}

/// Mean |DRR - exact DRR| as a share of the mean exact DRR.
double relative_error(const Image& drr, const Image& exact) {
    double error = 0, sum = 0;
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
        error += std::abs(drr.pixels[i] - exact.pixels[i]);
        sum += exact.pixels[i];
    }
    return error / sum;
}

/// error(n) = c n^-order, from 20 to 80 voxels a side.
template <class Error>
void expect_order(const Error& error, double least_order, double largest_error) {
    const double coarse = error(20), fine = error(80);
    const double order = std::log2(coarse / fine) / 2;
    EXPECT_TRUE(order >= least_order) << "order " << order << " from errors " << coarse << " to " << fine;
    EXPECT_TRUE(fine <= largest_error) << fine;
}

Phantom off_centre(Phantom phantom) {
    const RigidTransform turned = exp((Twist() << 0.15, 0.2, -0.3, 2.3, 1.1, -1.7).finished());
    for (Solid& solid : phantom.solids) {
        std::visit([&](auto& s) { s.ct_from_solid = turned; }, solid);
    }
    return phantom;
}

double twin_error(const Phantom& phantom, int n, Projector projector) {
    const Image twin = render(voxelise(phantom, grid_of(n), 8), small_view(), oblique_pose(), {projector, {}});
    return relative_error(twin, exact_drr(phantom, small_view(), oblique_pose()));
}

/// What order to expect of a field with a jump, edges of the image included. Silhouettes: a chord that rises as a root
/// (ellipsoid) is off by h^1/2 in a band of h, together h^1.5; one with a kink (box) by h in a band of h, h^2. Inside,
/// a ray crosses the jump at a phase of the lattice of its own: about 0.1 h a crossing, order 1 but small. Measured
/// over all: 1.4.
TEST(ReferenceTruth, VoxelisedTwinsConverge) {
    for (const Phantom& phantom : {ellipsoid_phantom({140, 140, 140}), box_phantom({140, 140, 140})}) {
        for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
            SCOPED_TRACE(phantom.name + " " + std::string(projector_name(projector)));
            expect_order([&](int n) { return twin_error(off_centre(phantom), n, projector); }, 1.35, 0.008);
        }
    }
}

/// Inside the silhouette of an oblique box: within 0.3 of the largest spacing of the exact chord, at every voxel size.
TEST(ReferenceTruth, VoxelisedBoxIsOffByAShareOfAVoxelInside) {
    const Phantom box = off_centre(box_phantom({140, 140, 140}));
    const Image exact = exact_drr(box, small_view(), oblique_pose());
    for (const int n : {20, 40, 80}) {
        const Image twin = render(voxelise(box, grid_of(n), 8), small_view(), oblique_pose(), {});
        int tested = 0;
        for (int y = 4; y < 44; ++y) {
            for (int x = 4; x < 44; ++x) {
                double bend = 0;  // second differences around: 0 where no edge of the box is near
                for (int k = -2; k <= 2; ++k) {
                    bend += std::abs(exact(x + 3, y + k) - 2 * exact(x, y + k) + exact(x - 3, y + k)) +
                            std::abs(exact(x + k, y + 3) - 2 * exact(x + k, y) + exact(x + k, y - 3));
                }
                if (bend > 0.05 || exact(x, y) < 0.1) continue;
                ASSERT_NEAR(twin(x, y), exact(x, y), 0.3 * 0.02 * grid_of(n).spacing_mm.maxCoeff())
                    << n << ": " << x << " " << y;
                ++tested;
            }
        }
        EXPECT_GT(tested, 100);
    }
}

/// A smooth field shows the backend's own order: exp(-r^2 / 2 s^2) integrates to sqrt(2 pi) s exp(-d^2 / 2 s^2) along a
/// line at distance d.
double gaussian_error(int n, Projector projector) {
    constexpr double kSigma_mm = 9, kPeakPerMm = 0.02;
    const Eigen::Vector3d centre_ct(2.3, 1.1, -1.7);
    Volume volume{grid_of(n), {}};
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x) {
                const double r2 = (volume.grid.ct_from_voxel(Eigen::Vector3d(x, y, z)) - centre_ct).squaredNorm();
                volume.attenuation_per_mm.push_back(
                    static_cast<float>(kPeakPerMm * std::exp(-r2 / (2 * kSigma_mm * kSigma_mm))));
            }
        }
    }
    const ViewGeometry view = small_view();
    const Eigen::Vector3d to_centre = oblique_pose() * centre_ct - source_world_mm(view);
    Image exact(48, 48);
    for (int v = 0; v < 48; ++v) {
        for (int u = 0; u < 48; ++u) {
            const double d2 = to_centre.cross(ray_direction_world(view, {u, v})).squaredNorm();
            exact(u, v) = static_cast<float>(kPeakPerMm * std::sqrt(2 * std::numbers::pi) * kSigma_mm *
                                             std::exp(-d2 / (2 * kSigma_mm * kSigma_mm)));
        }
    }
    return relative_error(render(volume, view, oblique_pose(), {projector, {}}), exact);
}

/// Linear interpolation: order 2. At 80 voxels it widens the blob by h^2 / 6 an axis: 0.3 % of s^2, of which the
/// image's L1 error is about as much.
TEST(ReferenceTruth, SmoothFieldConvergesWithOrderTwo) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        SCOPED_TRACE(std::string(projector_name(projector)));
        expect_order([&](int n) { return gaussian_error(n, projector); }, 1.9, 0.005);
    }
}

}  // namespace
}  // namespace raylign::detail
