#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/image/region.h"
#include "core/registration/strategy/template_search.h"
#include "raylign/backends.h"
#include "tests/support/scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail {
namespace {

constexpr double kPixel_mm = 200.0 / 64;  // at the object

/// One vertebra of the spine, and X-rays of all of it.
struct TemplateCase {
    explicit TemplateCase(int threads = 2) : backend(create_backend("cpu", {.cpu = {.threads = threads}}).backend) {
        const Phantom spine = spine_phantom({160, 160, 160});
        bone = crop(test::spine_volume(64), {{18, 20, 22}, {46, 56, 42}});
        for (float& v : bone.attenuation_per_mm) v = std::max(0.F, v - 0.0215F);
        views = test::with_exact_images(test::biplane_views(64), spine, truth, 1e6);
        extent = object_extent(bone);
        session = backend->prepare({bone, views, {}, {Metric::gc, {.sigma_px = 0.75, .radius_px = 3}}});
    }
    [[nodiscard]] TemplateFits search(const RigidTransform& nominal, TemplateRange range) {
        range.spacing_mm = kPixel_mm;
        return poses_by_templates(*session, views, nominal, extent, range, 200, [](double) {});
    }
    /// Turned about the object's centre, then shifted.
    [[nodiscard]] RigidTransform away(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) const {
        Twist turn = Twist::Zero();
        turn.head<3>() = turn_rad;
        return RigidTransform::translate(shift_mm) * exp_about(turn, truth * extent.centre_ct_mm) * truth;
    }
    RigidTransform truth = test::oblique_pose();
    Volume bone;
    std::vector<View> views;
    ObjectExtent extent;
    std::unique_ptr<Backend> backend;
    std::unique_ptr<Session> session;
};

TEST(TemplateSearch, PutsThePlaceFirstWhereTheOrientationIsRight) {
    TemplateCase c;
    const TemplateFits fits = c.search(c.away({0, 0, 0}, {9, -12, 6}), {.turn_rad = 0.01, .reach_mm = 20});
    ASSERT_FALSE(fits.best.empty());
    EXPECT_LT(apart_mm(fits.best.front().world_from_ct, c.truth, c.extent), test::kTemplatePlace_mm);
    EXPECT_LT(fits.best.front().cost, 0.5);
    EXPECT_TRUE(std::ranges::is_sorted(fits.best, {}, &Candidate::cost));
    for (const Candidate& fit : fits.best) EXPECT_LE(fit.cost, 2);
}

TEST(TemplateSearch, FindsTurnAndPlaceTogether) {
    TemplateCase c;
    const TemplateFits fits = c.search(c.away({0.25, -0.15, 0.3}, {5, 7, -6}), {.turn_rad = 0.7, .reach_mm = 25});
    double nearest_mm = 1e9;
    for (std::size_t i = 0; i < 20; ++i) {
        nearest_mm = std::min(nearest_mm, apart_mm(fits.best[i].world_from_ct, c.truth, c.extent));
    }
    // 6.5 degrees at a rim of some 30 mm, half a pixel each way: a refinement's work.
    EXPECT_LT(nearest_mm, test::kTemplateTurn_mm);
    EXPECT_GT(fits.tried, 100000);
}

TEST(TemplateSearch, StaysInReach) {
    TemplateCase c;
    const RigidTransform nominal = c.away({0, 0, 0}, {3, 0, 0});
    for (const Candidate& fit : c.search(nominal, {.turn_rad = 0.3, .reach_mm = 12}).best) {
        EXPECT_LE(apart_mm(fit.world_from_ct, nominal, c.extent), 12 + 1e-6);
        EXPECT_LE(rotation_angle_rad(fit.world_from_ct * inverse(nominal)), 0.3 + 1e-9);
    }
}

TEST(TemplateSearch, ReachesAllThatTheViewsSeeWithoutAReach) {
    TemplateCase c;
    const TemplateFits fits = c.search(c.away({0, 0, 0}, {50, -40, 45}), {.turn_rad = 0.01});
    double nearest_mm = 1e9;  // not the very first: perspective changed on the way, and the next vertebra looks alike
    for (std::size_t i = 0; i < 6; ++i) {
        nearest_mm = std::min(nearest_mm, apart_mm(fits.best[i].world_from_ct, c.truth, c.extent));
    }
    EXPECT_LT(nearest_mm, test::kTemplateField_mm);
    for (const Candidate& fit : fits.best) {
        for (const View& view : c.views) EXPECT_TRUE(is_seen(view, fit.world_from_ct * c.extent.centre_ct_mm));
    }
}

TEST(TemplateSearch, OneViewKeepsTheDepth) {
    TemplateCase c;
    c.views.pop_back();
    c.session = c.backend->prepare({c.bone, c.views, {}, {Metric::gc, {.sigma_px = 0.75, .radius_px = 3}}});
    const RigidTransform nominal = c.away({0, 0, 0}, {9, 0, 6});
    const Eigen::Vector3d centre = nominal * c.extent.centre_ct_mm;
    const Eigen::Vector3d depth = (centre - source_world_mm(c.views[0].geometry)).normalized();
    for (const Candidate& fit : c.search(nominal, {.turn_rad = 0.2, .reach_mm = 15}).best) {
        EXPECT_LE(std::abs(depth.dot(fit.world_from_ct * c.extent.centre_ct_mm - centre)), kPixel_mm / 2 + 1e-9);
    }
}

TEST(TemplateSearch, IsTheSameForAnyNumberOfThreads) {
    TemplateCase with_one(1), with_three(3);
    const RigidTransform nominal = with_one.away({0.1, 0, 0}, {5, 5, 5});
    const TemplateFits one = with_one.search(nominal, {.turn_rad = 0.4, .reach_mm = 15});
    const TemplateFits three = with_three.search(nominal, {.turn_rad = 0.4, .reach_mm = 15});
    ASSERT_EQ(one.best.size(), three.best.size());
    for (std::size_t i = 0; i < one.best.size(); ++i) {
        EXPECT_EQ(to_matrix(one.best[i].world_from_ct), to_matrix(three.best[i].world_from_ct));
        EXPECT_EQ(one.best[i].cost, three.best[i].cost);
    }
}

TEST(TemplateSearch, MaskedPixelsAreNoEvidence) {
    TemplateCase c;
    // Without the pixels that show the object there is nothing to find at its place.
    for (View& view : c.views) {
        view.weights = Image(64, 64, 1);
        for (int y = 16; y < 48; ++y)
            for (int x = 16; x < 48; ++x) view.weights(x, y) = 0;
    }
    c.session = c.backend->prepare({c.bone, c.views, {}, {Metric::gc, {.sigma_px = 0.75, .radius_px = 3}}});
    const TemplateFits fits = c.search(c.truth, {.turn_rad = 0.01});
    for (const Candidate& fit : fits.best) EXPECT_GT(apart_mm(fit.world_from_ct, c.truth, c.extent), 20);
}

TEST(TemplateSearch, CanBeStopped) {
    TemplateCase c;
    EXPECT_THROW((void)poses_by_templates(*c.session, c.views, c.truth, c.extent,
                                          {.turn_rad = 0.7, .reach_mm = 20, .spacing_mm = kPixel_mm}, 10,
                                          [](double) { throw Error("enough"); }),
                 Error);
}

TEST(TemplateSearch, ALatticeTooFineForMemoryIsMadeWiderAndCanBeStopped) {
    TemplateCase c;
    const TemplateRange fine{.turn_rad = 0.01, .reach_mm = 20, .spacing_mm = 0.04};
    const auto search = [&](const std::function<void(double)>& progress) {
        return poses_by_templates(*c.session, c.views, c.truth, c.extent, fine, 10, progress);
    };
    int turns = 0;
    const TemplateFits few = c.search(c.truth, {.turn_rad = 0.01, .reach_mm = 20});
    const TemplateFits fits = search([&](double share) { turns += share > 0; });
    EXPECT_GT(fits.tried, 100 * few.tried);
    EXPECT_LT(fits.tried, 4'000'000 * 16);
    EXPECT_LT(apart_mm(fits.best.front().world_from_ct, c.truth, c.extent), test::kTemplateWideLattice_mm);
    int calls = 0;
    EXPECT_THROW((void)search([&](double) {
                     if (++calls == 3) throw Error("enough");
                 }),
                 Error);
}

TEST(TemplateSearch, FindsNothingWhereNoPlaceIsSeenByAllViews) {
    TemplateCase c;
    const RigidTransform nowhere = RigidTransform::translate({0, 0, 5000}) * c.truth;
    const TemplateFits fits = c.search(nowhere, {.turn_rad = 0.1, .reach_mm = 20});
    EXPECT_TRUE(fits.best.empty());
    EXPECT_EQ(fits.tried, 0);
}

}  // namespace
}  // namespace raylign::detail
