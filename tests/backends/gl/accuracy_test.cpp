// Parity ladder, steps 3 and 4: against the reference with exact interpolation, then texture filters against exact.

#include <gtest/gtest.h>

#include "core/validation/tolerances.h"
#include "gl_scenes.h"
#include "tests/support/as_hardware.h"
#include "tests/support/image_compare.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::gl {
namespace {

struct Case {
    std::string name;
    Projector projector;
    Storage storage;
    bool exact;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class GlAccuracy : public testing::TestWithParam<Case> {
protected:
    void SetUp() override {
        RAYLIGN_NEED_GL(api);
        context_ = open_device(api, {});
        session_ = make_session();
        oracle_ = create_backend("reference").backend->prepare(spine_.scene(GetParam().projector));
    }
    [[nodiscard]] std::unique_ptr<Session> make_session(Metric metric = Metric::gc) const {
        return std::make_unique<GlSession>(context_, spine_.scene(GetParam().projector, metric),
                                           PipelineOptions{.storage = GetParam().storage, .exact = GetParam().exact});
    }
    /// What this case may be off, as a share of the image's maximum.
    [[nodiscard]] double share() const {
        if (!GetParam().exact && context_->device().filter_bits > 0) return kFilterBitsShare;
        return GetParam().storage == Storage::int16 ? test::kInt16ImageShare : test::kFloatImageShare;
    }

    test::SpineScene spine_{40, 48};
    std::shared_ptr<Context> context_;
    std::unique_ptr<Session> session_, oracle_;
};

TEST_P(GlAccuracy, ImagesAreThoseOfTheReference) {
    for (int i = 0; i < 6; ++i) {  // around the compass, so that every axis dominates once
        const RigidTransform pose = exp((Twist() << 0.5 * i, 0.9 * i, -0.4 * i, 3, -2, i).finished());
        for (std::size_t view = 0; view < 2; ++view) {
            EXPECT_TRUE(test::images_near(session_->render(pose, view), oracle_->render(pose, view), share()))
                << "pose " << i << ", view " << view;
        }
    }
}

TEST_P(GlAccuracy, CostsAreThoseOfTheReference) {
    const auto poses = spine_.poses(4);
    const auto ours = test::costs(*session_, poses), theirs = test::costs(*oracle_, poses);
    const bool filter_bits = !GetParam().exact && context_->device().filter_bits > 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_NEAR(ours[i], theirs[i], filter_bits ? kFilterBitsCost : test::kCost);
    }
}

TEST_P(GlAccuracy, DerivativeSumsAreThoseOfTheReference) {
    const auto poses = spine_.poses(3);
    std::vector<Linearization> ours(poses.size()), theirs(poses.size());
    session_->linearize(poses, {3, -5, 8}, ours);
    oracle_->linearize(poses, {3, -5, 8}, theirs);
    const auto costs = test::costs(*session_, poses);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_LT((ours[i].gradient - theirs[i].gradient).norm(), 2e-3 * theirs[i].gradient.norm()) << i;
        EXPECT_LT((ours[i].curvature - theirs[i].curvature).norm(), 1e-3 * theirs[i].curvature.norm()) << i;
        EXPECT_NEAR(ours[i].cost, costs[i], 1e-6) << "as evaluate says: " << i;
    }
}

TEST_P(GlAccuracy, NewWeightsCountAtOnce) {
    const auto poses = spine_.poses(2);
    const auto before = test::costs(*session_, poses);
    std::vector<Image> weights(2, Image(48, 48, 1));
    for (Image& image : weights) {
        for (int y = 0; y < 48; ++y) {
            for (int x = 0; x < 48; ++x) image(x, y) = (x * 7 + y * 3) % 5 * 0.25F;
        }
    }
    session_->set_weights(weights);
    oracle_->set_weights(weights);
    const auto ours = test::costs(*session_, poses), theirs = test::costs(*oracle_, poses);
    const bool filter_bits = !GetParam().exact && context_->device().filter_bits > 0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_NE(ours[i], before[i]);
        EXPECT_NEAR(ours[i], theirs[i], filter_bits ? kFilterBitsCost : test::kCost);
    }
}

TEST_P(GlAccuracy, OnlySumsComeBack) {
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const auto session = make_session(metric);
        const std::uint64_t gradients = 5 * 2 * session->channel_count();  // poses, views
        (void)test::costs(*session, spine_.poses(5));
        EXPECT_GT(session->counters().bytes_to_host, 0u);
        EXPECT_LE(session->counters().bytes_to_host, 64 * gradients);
        const std::uint64_t before = session->counters().bytes_to_host;
        std::vector<Linearization> results(5);
        session->linearize(spine_.poses(5), {0, 0, 0}, results);
        EXPECT_LE(session->counters().bytes_to_host - before, 400 * gradients);
    }
}

TEST_P(GlAccuracy, ABatchOfManyLinearizationsHasTheBitsOfSingleOnes) {
    const auto poses = spine_.poses(5);
    std::vector<Linearization> batch(poses.size());
    session_->linearize(poses, {3, -5, 8}, batch);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        Linearization one;
        session_->linearize({&poses[i], 1}, {3, -5, 8}, {&one, 1});
        EXPECT_EQ(one.gradient, batch[i].gradient);
        EXPECT_EQ(one.curvature, batch[i].curvature);
    }
}

// From the shortest filter to the longest: tiles of pixels keep their rows in a work group's shared memory.
TEST(GlFilter, OfAnyRadiusGivesTheSumsOfTheReference) {
    RAYLIGN_NEED_GL(api);
    const auto context = open_device(api, {});
    const test::SpineScene spine(24, 141);
    const auto poses = spine.poses(1);
    for (const GradientFilter& filter : {GradientFilter{0.5, 1}, GradientFilter{3, 9}, GradientFilter{20, 64}}) {
        Scene scene = spine.scene();
        scene.similarity.filter = filter;
        GlSession session(context, scene, {.storage = Storage::float32, .exact = true});
        const auto oracle = create_backend("reference").backend->prepare(scene);
        Linearization ours, theirs;
        session.linearize(poses, {3, -5, 8}, {&ours, 1});
        oracle->linearize(poses, {3, -5, 8}, {&theirs, 1});
        EXPECT_NEAR(ours.cost, theirs.cost, test::kCost) << filter.radius_px;
        EXPECT_LT((ours.gradient - theirs.gradient).norm(), 2e-3 * theirs.gradient.norm()) << filter.radius_px;
        EXPECT_LT((ours.curvature - theirs.curvature).norm(), 1e-3 * theirs.curvature.norm()) << filter.radius_px;
    }
}

// A GPU is waited for once a call, where software OpenGL is at every stage: nothing may be read too early.
TEST(GlHardware, ACallThatWaitsOnceGivesTheSameBits) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto software = open_device(api, {});
    // Exact: where the tests emulate a GPU's texture filter, only software does.
    GlSession stages(software, spine.scene(), {.exact = true, .parts = 1});
    const auto poses = spine.poses(4);
    const auto expected = test::costs(stages, poses);
    const Image drr = stages.render(poses[1], 1);
    const auto gpu = open_device(test::as_hardware(api), {});
    ASSERT_FALSE(gpu->device().software);
    GlSession whole(gpu, spine.scene(), {.exact = true, .parts = 1});
    GlSession chunks(gpu, spine.scene(), {.exact = true, .chunk_ms = 1e-3, .parts = 1});
    for (int round = 0; round < 3; ++round) {
        for (GlSession* const session : {&whole, &chunks}) {
            EXPECT_EQ(test::costs(*session, poses), expected);
            std::vector<Linearization> at(poses.size());
            session->linearize(poses, {0, 0, 0}, at);
            for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(at[i].cost, expected[i], test::kCost);
            EXPECT_EQ(session->render(poses[1], 1).pixels, drr.pixels);
        }
    }
}

TEST(GlHardware, ThePapersPipelineGivesTheSameBits) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto poses = spine.poses(3);
    Gl2006Options options;
    options.interpolation = Interpolation::exact;
    const auto expected = test::costs(*make_gl_2006_backend(api, options)->prepare(spine.scene()), poses);
    const auto gpu = make_gl_2006_backend(test::as_hardware(api), options);
    EXPECT_EQ(gpu->info().timing, "timer queries");
    const auto session = gpu->prepare(spine.scene());
    for (int round = 0; round < 3; ++round) EXPECT_EQ(test::costs(*session, poses), expected);
}

INSTANTIATE_TEST_SUITE_P(All, GlAccuracy,
                         testing::Values(Case{"JosephFloat32Exact", Projector::joseph, Storage::float32, true},
                                         Case{"JosephFloat32Hardware", Projector::joseph, Storage::float32, false},
                                         Case{"JosephInt16Hardware", Projector::joseph, Storage::int16, false},
                                         Case{"TrilinearFloat32Exact", Projector::trilinear, Storage::float32, true},
                                         Case{"TrilinearInt16Hardware", Projector::trilinear, Storage::int16, false}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace raylign::detail::gl
