#include "core/surface/surface_drr.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/geometry/camera.h"
#include "core/image/gradient_filter.h"
#include "raylign/phantom.h"
#include "tests/support/errors.h"
#include "tests/support/mesh_shapes.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kPerMm = 0.05, kOpen = std::numeric_limits<double>::infinity();

Surface with_attenuation(Surface surface, double per_mm = kPerMm) {
    surface.attenuation_per_mm.assign(surface.triangles.size(), static_cast<float>(per_mm));
    return surface;
}

struct Drawn {
    Image drr;
    std::array<Image, 6> derivatives;
};

class SurfaceDrrTest : public testing::Test {
protected:
    [[nodiscard]] Drawn draw(const Surface& surface, const RigidTransform& pose, bool derivatives = false,
                             double ceiling = kOpen) const {
        return draw_on(view_, surface, pose, derivatives, ceiling);
    }

    [[nodiscard]] Drawn draw_on(const ViewGeometry& view, const Surface& surface, const RigidTransform& pose,
                                bool derivatives, double ceiling) const {
        const SurfaceDrr drr(surface, grid_);
        const Eigen::Vector2i size = view.camera.size_px;
        RayFrame frame = make_ray_frame(grid_, view, pose);
        frame.ceiling = ceiling;
        const RayFrameDerivatives slopes = make_ray_frame_derivatives(grid_, view, pose, pose * centre_ct_mm_);
        // What is not drawn would show.
        std::vector<float> floats(static_cast<std::size_t>(7 * size.prod()), 99);
        const SurfaceProjection seen = drr.project(frame, size);
        for (std::size_t band = seen.bands.size(); band-- > 0;) {
            drr.draw(seen, frame, derivatives ? &slopes : nullptr, band, {floats.data(), size.x(), size.prod()});
        }
        Drawn drawn;
        for (int i = 0; i < (derivatives ? 7 : 1); ++i) {
            Image& image = i == 0 ? drawn.drr : drawn.derivatives[static_cast<std::size_t>(i - 1)];
            image = Image(size.x(), size.y());
            std::copy_n(floats.begin() + i * size.prod(), size.prod(), image.pixels.begin());
        }
        return drawn;
    }

    [[nodiscard]] ViewGeometry finer(int n) const {
        ViewGeometry fine = view_;
        fine.camera = detail::finer(view_.camera, n);
        return fine;
    }

    /// What pixels show on average of n x n rays each, given what these let through.
    template <class Transmission>
    [[nodiscard]] Image averaged(int n, double ceiling, const Transmission& transmission) const {
        const double floor = std::exp(-ceiling);
        Image image(view_.camera.size_px.x(), view_.camera.size_px.y());
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) {
                double arriving = 0;
                for (int k = 0; k < n * n; ++k) arriving += transmission(n * x + k % n, n * y + k / n) / (n * n);
                image(x, y) = static_cast<float>(-std::log(floor + (1 - floor) * arriving));
            }
        }
        return image;
    }

    /// What a pixel shows of the phantom: the mean of what arrives on its four rays, exactly.
    [[nodiscard]] Image shown(const Phantom& phantom, const RigidTransform& pose, double ceiling) const {
        const Image rays = exact_drr(phantom, finer(2), pose);
        return averaged(2, ceiling, [&](int x, int y) { return std::exp(-double{rays(x, y)}); });
    }

    /// The same of the surface by 12 x 12 rays a pixel, so that no outline passes in steps.
    [[nodiscard]] Image smooth(const Surface& surface, const RigidTransform& pose, double ceiling) const {
        constexpr int kFiner = 6;
        const Image fine = draw_on(finer(kFiner), surface, pose, false, kOpen).drr;
        return averaged(kFiner, ceiling, [&](int x, int y) { return std::exp(-double{fine(x, y)}); });
    }

    struct Slopes {
        double worst_share = 0;  ///< by how much the share of the right change that is in ours misses 1, at most
        double worst_rest = 0;   ///< what else is in ours, as a share of the strongest right change
    };
    /// Derivatives against central differences, of the gradient images that costs are made of.
    [[nodiscard]] Slopes slopes(const Surface& surface, const RigidTransform& pose, double ceiling) const {
        const Drawn at = draw(surface, pose, true, ceiling);
        const GradientTaps taps = gradient_taps({1.5, 5});
        constexpr double kStep_mm = 0.1, kRadius_mm = 30;
        Slopes found;
        double most = 0;
        for (int p = 0; p < 6; ++p) {
            const double per_step = p < 3 ? 1 / kRadius_mm : 1;
            const Twist twist = kStep_mm * per_step * Twist::Unit(p);
            const Vector3d centre = pose * centre_ct_mm_;
            const Image plus = smooth(surface, exp_about(twist, centre) * pose, ceiling);
            const Image minus = smooth(surface, exp_about(-twist, centre) * pose, ceiling);
            Image own = at.derivatives[static_cast<std::size_t>(p)], right = plus;
            for (std::size_t i = 0; i < right.pixels.size(); ++i) {
                right.pixels[i] = static_cast<float>((double{plus.pixels[i]} - minus.pixels[i]) / (2 * kStep_mm));
                own.pixels[i] *= static_cast<float>(per_step);
            }
            const auto ours = gradient_images(own, taps), rights = gradient_images(right, taps);
            const double share = dot(ours, rights) / dot(rights, rights);
            const double rest = dot(ours, ours) - share * share * dot(rights, rights);
            found.worst_share = std::max(found.worst_share, std::abs(share - 1));
            found.worst_rest = std::max(found.worst_rest, std::sqrt(std::max(rest, 0.0)));
            most = std::max(most, std::sqrt(dot(rights, rights)));
        }
        found.worst_rest /= most;
        return found;
    }

    static double dot(const std::array<Image, 2>& a, const std::array<Image, 2>& b) {
        double sum = 0;
        for (std::size_t c = 0; c < 2; ++c) {
            for (std::size_t i = 0; i < a[c].pixels.size(); ++i) sum += double{a[c].pixels[i]} * b[c].pixels[i];
        }
        return sum;
    }

    const ViewGeometry view_ = test::biplane_views(120).front().geometry;
    const VoxelGrid grid_ = centred_grid({50, 60, 70}, {1.3, 1.1, 0.9});
    const Vector3d centre_ct_mm_{2, -3, 4};
    const RigidTransform pose_ = test::oblique_pose();
    const Surface box_ = with_attenuation(test::box_mesh<Surface>({-20, -24, -15}, {22, 18, 25}));
};

TEST_F(SurfaceDrrTest, ABoxIsExact) {
    const Phantom box{"box", {Box{{Eigen::Matrix3d::Identity(), {1, -3, 5}}, {21, 21, 20}, kPerMm}}};
    for (const double ceiling : {kOpen, 1.5}) {
        const Image drawn = draw(box_, pose_, false, ceiling).drr, right = shown(box, pose_, ceiling);
        float most = 0;
        for (std::size_t i = 0; i < right.pixels.size(); ++i) {
            ASSERT_NEAR(drawn.pixels[i], right.pixels[i], 2e-5) << i << ", ceiling " << ceiling;
            most = std::max(most, drawn.pixels[i]);
        }
        EXPECT_GT(most, 1);
    }
}

TEST_F(SurfaceDrrTest, ACavityAndABodyBesideAreExactWhereTheyAttenuateDifferently) {
    const Phantom phantom{"hollow",
                          {Box{{Eigen::Matrix3d::Identity(), {1, -3, 5}}, {21, 21, 20}, kPerMm},
                           Box{{Eigen::Matrix3d::Identity(), {0, 0, 5}}, {10, 8, 9}, -kPerMm},
                           Box{{Eigen::Matrix3d::Identity(), {40, 0, 0}}, {5, 6, 7}, 0.2}}};
    Surface all =
        test::joined(test::joined(box_, test::inside_out(test::box_mesh<Surface>({-10, -8, -4}, {10, 8, 14}))),
                     test::box_mesh<Surface>({35, -6, -7}, {45, 6, 7}));
    all.attenuation_per_mm.resize(24, static_cast<float>(kPerMm));
    all.attenuation_per_mm.resize(36, 0.2F);
    const Image drawn = draw(all, pose_).drr, right = shown(phantom, pose_, kOpen);
    for (std::size_t i = 0; i < right.pixels.size(); ++i) ASSERT_NEAR(drawn.pixels[i], right.pixels[i], 3e-5) << i;
}

TEST_F(SurfaceDrrTest, AGridThatMirrorsChangesNothing) {
    VoxelGrid mirrored = grid_;
    mirrored.direction.col(0) *= -1;
    const Image drawn = draw(box_, pose_).drr;
    const SurfaceDrr other(box_, mirrored);
    const RayFrame frame = make_ray_frame(mirrored, view_, pose_);
    Image image(view_.camera.size_px.x(), view_.camera.size_px.y());
    const SurfaceProjection seen = other.project(frame, view_.camera.size_px);
    for (std::size_t band = 0; band < seen.bands.size(); ++band) {
        other.draw(seen, frame, nullptr, band, {image.pixels.data(), image.width, 0});
    }
    for (std::size_t i = 0; i < image.pixels.size(); ++i) ASSERT_NEAR(image.pixels[i], drawn.pixels[i], 2e-5) << i;
}

TEST_F(SurfaceDrrTest, NoRaySlipsThroughAnEdge) {
    // Fine facets seen along their edges, and rays through vertices: the view's axis meets the ball's pole.
    const Surface ball = with_attenuation(test::ball_mesh<Surface>({0, 0, 0}, 20, 90), 1);
    const Phantom sphere{"ball", {Ellipsoid{{}, {20, 20, 20}, 1}}};
    for (const RigidTransform& pose : {RigidTransform{}, pose_}) {
        const Image drawn = draw(ball, pose).drr, right = shown(sphere, pose, kOpen);
        for (std::size_t i = 0; i < right.pixels.size(); ++i) {
            // Facets lie within the sphere: by 0.003 mm in the middle, and where rays graze it by more of their length.
            ASSERT_NEAR(drawn.pixels[i], right.pixels[i], right.pixels[i] > 20 ? 0.05 : 1.0) << i;
        }
    }
}

// What is not the right change is the noise of an outline that passes four rays a pixel in steps, the more so where the
// logarithm of what arrives makes much of it.
TEST_F(SurfaceDrrTest, DerivativesAreTheLimitOfDifferences) {
    const Surface ball = with_attenuation(test::ball_mesh<Surface>({3, -2, 1}, 25, 40));
    const Slopes of_ball = slopes(ball, pose_, kOpen), of_box = slopes(box_, pose_, 1.2);
    EXPECT_LT(of_ball.worst_share, 0.04);
    EXPECT_LT(of_ball.worst_rest, 0.08);
    EXPECT_LT(of_box.worst_share, 0.06);
    EXPECT_LT(of_box.worst_rest, 0.13);
}

TEST_F(SurfaceDrrTest, SoTheyAreOfWallsThatRaysRunAlong) {
    // Metal with sides along the view's axis: nothing but a jump of the length tells where the box ends. Which edge
    // of a wall is its outline, that next to the source or the other, differs from ray to ray.
    const Surface metal = with_attenuation(box_, 1);
    const Eigen::AngleAxisd turn(0.2, Vector3d::UnitZ());
    const RigidTransform along{view_.camera_from_world.rotation.transpose() * turn.toRotationMatrix(), {0, 0, 0}};
    const Slopes of_walls = slopes(metal, along, 2);
    EXPECT_LT(of_walls.worst_share, 0.15);
    EXPECT_LT(of_walls.worst_rest, 0.8);
}

TEST_F(SurfaceDrrTest, WhatLiesBehindTheDetectorDoesNotCount) {
    const Image whole = draw(box_, pose_).drr;
    RayFrame frame = make_ray_frame(grid_, view_, pose_);
    const SurfaceDrr drr(box_, grid_);
    const SurfaceProjection seen = drr.project(frame, view_.camera.size_px);
    frame.depth_max_mm = seen.depth_mm;  // a detector through the box's middle
    Image cut(whole.width, whole.height);
    for (std::size_t band = 0; band < seen.bands.size(); ++band) {
        drr.draw(seen, frame, nullptr, band, {cut.pixels.data(), cut.width, 0});
    }
    const float half = cut(60, 60), all = whole(60, 60);
    EXPECT_GT(half, 0.3F * all);
    EXPECT_LT(half, 0.7F * all);
}

TEST_F(SurfaceDrrTest, NothingOfASurfaceAroundTheSourceIsSeen) {
    const Vector3d source = source_world_mm(view_);
    const Drawn drawn = draw(box_, {Eigen::Matrix3d::Identity(), source}, true);
    EXPECT_THAT(drawn.drr.pixels, testing::Each(0.F));
    EXPECT_THAT(drawn.derivatives[3].pixels, testing::Each(0.F));
}

TEST_F(SurfaceDrrTest, ABadSurfaceIsNamed) {
    const auto message = [&](const Surface& surface) {
        return test::error_of([&] { (void)SurfaceDrr(surface, grid_); });
    };
    EXPECT_THAT(message({}), HasSubstr("no triangles"));
    Surface bad = box_;
    bad.triangles[5][1] = 8;
    EXPECT_THAT(message(bad), HasSubstr("corner of triangle 5 = 8"));
    bad = box_;
    bad.vertices_mm[2].y() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THAT(message(bad), HasSubstr("vertex 2"));
    bad = box_;
    bad.attenuation_per_mm[3] = std::numeric_limits<float>::infinity();
    EXPECT_THAT(message(bad), HasSubstr("attenuation of triangle 3"));
    bad.attenuation_per_mm.pop_back();
    EXPECT_THAT(message(bad), HasSubstr("12, one for each triangle"));
}

}  // namespace
}  // namespace raylign::detail
