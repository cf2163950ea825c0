#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backends/gl/chunks.h"
#include "gl_scenes.h"
#include "tests/support/as_hardware.h"
#include "tests/support/image_compare.h"
#include "tests/support/mesh_shapes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::gl {
namespace {

TEST(GlChunks, CoverEveryFrameOnceInOrderWithinTheLimits) {
    const std::vector<double> samples = {10, 20, 30, 5, 5, 5, 5, 200, 1};
    const auto chunks = plan_chunks(samples, {.samples_per_ms = 1, .most_ms = 40, .most_frames = 3});
    std::size_t next = 0;
    for (const Chunk& chunk : chunks) {
        EXPECT_EQ(chunk.first, next);
        next += chunk.count;
        EXPECT_LE(chunk.count, 3u);
        double sum = 0;
        for (std::size_t i = 0; i < chunk.count; ++i) sum += samples[chunk.first + i];
        EXPECT_LE(sum / chunk.row_parts, 40);
        EXPECT_TRUE(chunk.count == 1 || chunk.row_parts == 1);
    }
    EXPECT_EQ(next, samples.size());
    EXPECT_EQ(chunks[0].count, 2u) << "as many as fit";
}

TEST(GlChunks, AFrameThatTakesTooLongIsCutByRows) {
    const std::vector<double> samples = {1000};
    EXPECT_EQ(plan_chunks(samples, {2, 100, 8})[0].row_parts, 5);
    EXPECT_EQ(plan_chunks(samples, {1e-9, 100, 8})[0].row_parts, 4096) << "there is an end to it";
    EXPECT_TRUE(plan_chunks({}, {}).empty());
}

TEST(GlChunks, DoNotChangeABit) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto poses = spine.poses(5);
    const auto context = open_device(api, {});
    GlSession whole(context, spine.scene(), {});
    const auto expected = test::costs(whole, poses);
    // A budget of a few rays at a time, and memory for one frame only.
    GlSession cut(context, spine.scene(), {.chunk_ms = 1e-3, .work_bytes = 1});
    EXPECT_EQ(test::costs(cut, poses), expected);
    EXPECT_EQ(cut.render(poses[1], 1).pixels, whole.render(poses[1], 1).pixels);
    std::vector<Linearization> a(poses.size()), b(poses.size());
    whole.linearize(poses, {1, 2, 3}, a);
    cut.linearize(poses, {1, 2, 3}, b);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_EQ(a[i].gradient, b[i].gradient);
        EXPECT_EQ(a[i].curvature, b[i].curvature);
    }
}

// 65535 on most devices, which a batch of small images would exceed.
TEST(GlChunks, HaveNoMoreFramesThanADispatchHasLayers) {
    RAYLIGN_NEED_GL(api);
    static GLuint most = 0;
    static decltype(api.gl.DispatchCompute) real = nullptr;
    static decltype(api.gl.GetIntegeri_v) real_limit = nullptr;
    real = api.gl.DispatchCompute;
    real_limit = api.gl.GetIntegeri_v;
    const test::SpineScene spine;
    const auto poses = spine.poses(5);
    const auto expected = test::costs(*make_gl_backend(api, {})->prepare(spine.scene()), poses);
    api.gl.DispatchCompute = [](GLuint x, GLuint y, GLuint z) {
        most = std::max(most, z);
        real(x, y, z);
    };
    api.gl.GetIntegeri_v = [](GLenum name, GLuint index, GLint* value) {
        name == GL_MAX_COMPUTE_WORK_GROUP_COUNT&& index == 2 ? void(*value = 3) : real_limit(name, index, value);
    };
    const auto session = make_gl_backend(api, {})->prepare(spine.scene());
    (void)test::costs(*session, poses);  // the volume's layouts are made, of more layers
    most = 0;
    EXPECT_EQ(test::costs(*session, poses), expected);
    EXPECT_EQ(most, 3u) << "of ten frames";
}

TEST(GlChunks, InvocationsThatShareARayFindItsSums) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto poses = spine.poses(2);
    const auto context = open_device(api, {});
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        GlSession alone(context, spine.scene(projector), {.parts = 1});
        std::vector<Linearization> expected(poses.size()), found(poses.size());
        alone.linearize(poses, {1, 2, 3}, expected);
        for (const int parts : {2, 4}) {
            GlSession shared(context, spine.scene(projector), {.parts = parts});
            EXPECT_TRUE(
                test::images_near(shared.render(poses[1], 1), alone.render(poses[1], 1), test::kFloatImageShare))
                << parts;
            shared.linearize(poses, {1, 2, 3}, found);
            for (std::size_t i = 0; i < poses.size(); ++i) {
                EXPECT_NEAR(found[i].cost, expected[i].cost, test::kCost) << parts;
                EXPECT_LT((found[i].gradient - expected[i].gradient).norm(), 1e-4 * expected[i].gradient.norm())
                    << parts << ": float sums of the same segments";
            }
        }
    }
}

TEST(GlRate, IsLearnedFromWhatWasCast) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine(48, 65);
    const auto context = open_device(api, {});
    const double guess = context->samples_per_ms();
    GlSession session(context, spine.scene(), {});
    (void)test::costs(session, spine.poses(2));
    const double learned = context->samples_per_ms();
    EXPECT_NE(learned, guess);
    context->observe_samples_per_ms(learned / 1000);
    EXPECT_GT(context->samples_per_ms(), learned / 2) << "one slow image is not believed";
    for (int i = 0; i < 100; ++i) context->observe_samples_per_ms(learned / 1000);
    EXPECT_EQ(context->samples_per_ms(), learned / 1000) << "many are";
}

/// The small scene with a ball of triangles for a volume: the host draws its DRRs.
test::SpineScene drawn_scene() {
    test::SpineScene scene;
    Surface ball = test::ball_mesh<Surface>({0, 0, 0}, 22, 12);
    ball.attenuation_per_mm.assign(ball.triangles.size(), 0.06F);
    scene.volume.surface = std::make_shared<const Surface>(std::move(ball));
    return scene;
}

TEST(GlRate, IsNotForgottenWhileTheHostDraws) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene scene = drawn_scene();
    const auto context = open_device(api, {});
    const double before = context->samples_per_ms();
    GlSession session(context, scene.scene(), {});
    (void)test::costs(session, scene.poses(2));
    EXPECT_EQ(context->samples_per_ms(), before);
}

// What is drawn before anything is submitted is at no time of the device's.
TEST(GlTiming, CountsWhatTheHostDraws) {
    RAYLIGN_NEED_GL(api);
    api.gl.GetQueryObjectui64v = [](GLuint, GLenum, GLuint64* value) { *value = 7; };
    const auto context = open_device(test::as_hardware(api), {});
    ASSERT_FALSE(context->device().software);
    context->keep_programs_in({});
    const test::SpineScene scene = drawn_scene();
    GlSession session(context, scene.scene(), {});
    (void)test::costs(session, scene.poses(2));
    EXPECT_GT(session.timing().drr_s, 0);
    EXPECT_EQ(session.timing().gradient_s, 0) << "the device's, whose clock stands here";
}

}  // namespace
}  // namespace raylign::detail::gl
