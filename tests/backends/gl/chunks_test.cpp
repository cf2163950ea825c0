#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "backends/gl/chunks.h"
#include "gl_scenes.h"

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

TEST(GlTuning, WorkGroupShapesDoNotChangeABit) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto poses = spine.poses(2);
    std::vector<std::vector<double>> found;
    for (const Tuning& tuning : {Tuning{8, 8, 42}, Tuning{32, 4, 6}, Tuning{16, 8, 1}}) {
        const auto context = open_device(api, {});
        context->tuning() = tuning;
        context->tuning().fitted_samples = 1e300;  // as given, not fitted again
        GlSession session(context, spine.scene(), {});
        found.push_back(test::costs(session, poses));
        EXPECT_EQ(context->tuning().tile_x, tuning.tile_x);
    }
    EXPECT_EQ(found[1], found[0]);
    EXPECT_EQ(found[2], found[0]);
}

TEST(GlTuning, IsFittedByTheFirstSessionAndAgainForMuchLargerScenes) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene small, large(48, 65);
    const auto context = open_device(api, {});
    GlSession first(context, small.scene(), {});
    (void)test::costs(first, small.poses(1));
    const double fitted = context->tuning().fitted_samples;
    EXPECT_GT(fitted, 0);
    EXPECT_GT(context->tuning().samples_per_ms, 0);
    (void)test::costs(first, small.poses(2));
    EXPECT_EQ(context->tuning().fitted_samples, fitted);
    GlSession second(context, large.scene(), {});
    (void)test::costs(second, large.poses(1));
    EXPECT_GT(context->tuning().fitted_samples, 4 * fitted);
}

}  // namespace
}  // namespace raylign::detail::gl
