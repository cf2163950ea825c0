#include <gtest/gtest.h>

#include <latch>
#include <thread>
#include <vector>

#include "backends/gl/context.h"
#include "core/base/usable_cores.h"
#include "gl_scenes.h"

namespace raylign::detail::gl {
namespace {

TEST(GlContext, IsCurrentOnlyWhileAGuardLives) {
    RAYLIGN_NEED_GL(api);
    const auto first = open_device(api, {}), second = open_device(api, {});
    EXPECT_EQ(api.egl.GetCurrentContext(), EGL_NO_CONTEXT);
    {
        const Current outer(*first);
        const EGLContext of_first = api.egl.GetCurrentContext();
        EXPECT_NE(of_first, EGL_NO_CONTEXT);
        {
            const Current inner(*second);
            EXPECT_NE(api.egl.GetCurrentContext(), of_first);
            const Current again(*first);
            EXPECT_EQ(api.egl.GetCurrentContext(), of_first);
        }
        EXPECT_EQ(api.egl.GetCurrentContext(), of_first) << "what was current before is current again";
    }
    EXPECT_EQ(api.egl.GetCurrentContext(), EGL_NO_CONTEXT);
}

TEST(GlContext, SessionsOfOneDeviceWorkInSeveralThreads) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto backend = make_gl_backend(api, {});
    const auto alone = test::costs(*backend->prepare(spine.scene()), spine.poses(3));
    std::vector<std::vector<double>> found(3);
    std::vector<std::unique_ptr<Session>> sessions;
    for (std::size_t i = 0; i < found.size(); ++i) sessions.push_back(backend->prepare(spine.scene()));
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < found.size(); ++i) {
        threads.emplace_back([&, i] { found[i] = test::costs(*sessions[i], spine.poses(3)); });
    }
    for (std::thread& thread : threads) thread.join();
    for (const auto& costs : found) EXPECT_EQ(costs, alone);
}

TEST(GlContext, ASessionOutlivesItsBackend) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    auto backend = make_gl_backend(api, {});
    const auto session = backend->prepare(spine.scene());
    const auto before = test::costs(*session, spine.poses(1));
    backend.reset();
    EXPECT_EQ(test::costs(*session, spine.poses(1)), before);
}

// No clock decides: where threads are missing this never returns, and CTest's timeout is the failure.
TEST(GlHostThreads, AreAsManyAsAskedFor) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    constexpr int kMany = 5;
    const auto backend = make_gl_backend(api, {.threads = kMany});
    EXPECT_EQ(backend->info().threads, kMany);
    const auto session = backend->prepare(spine.scene()), other = session->with_views(spine.views, {});
    const auto paper = make_gl_2006_backend(api, {{.threads = kMany}})->prepare(spine.scene());
    for (Session* const asked : {session.get(), other.get(), paper.get()}) {
        std::latch all(kMany);
        asked->for_each_index(kMany, [&](std::size_t) { all.arrive_and_wait(); });
    }
}

TEST(GlHostThreads, OneIsTheCallers) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto session = make_gl_backend(api, {.threads = 1})->prepare(spine.scene());
    std::vector<std::thread::id> of_turns(100);
    session->for_each_index(of_turns.size(), [&](std::size_t i) { of_turns[i] = std::this_thread::get_id(); });
    EXPECT_EQ(of_turns, std::vector(of_turns.size(), std::this_thread::get_id()));
}

TEST(GlHostThreads, AreByDefaultTheUsableCores) {
    RAYLIGN_NEED_GL(api);
    EXPECT_EQ(make_gl_backend(api, {})->info().threads, usable_cores());
    EXPECT_EQ(make_gl_2006_backend(api, {})->info().threads, usable_cores());
}

TEST(GlHostThreads, OutOfRangeAreRefused) {
    RAYLIGN_NEED_GL(api);
    for (const int threads : {0, -1, 1025}) {
        EXPECT_THROW((void)make_gl_backend(api, {.threads = threads}), Error);
        EXPECT_THROW((void)make_gl_2006_backend(api, {{.threads = threads}}), Error);
    }
}

TEST(GlHandle, MovesAndDeletesOnce) {
    RAYLIGN_NEED_GL(api);
    static int deleted = 0;
    static decltype(api.gl.DeleteBuffers) real = nullptr;
    real = api.gl.DeleteBuffers;
    api.gl.DeleteBuffers = [](GLsizei count, const GLuint* ids) {
        deleted += count;
        real(count, ids);
    };
    const auto context = open_device(api, {});
    const Current current(*context);
    {
        Buffer a = make_buffer(context->gl(), "a");
        Buffer b = std::move(a);
        Buffer c;
        c = std::move(b);
        EXPECT_NE(c.id(), 0u);
        EXPECT_FALSE(b);
    }
    EXPECT_EQ(deleted, 1);
}

TEST(GlHandle, IsLabelled) {
    RAYLIGN_NEED_GL(api);
    static std::string label;
    api.gl.ObjectLabel = [](GLenum, GLuint, GLsizei length, const GLchar* text) { label.assign(text, length); };
    const auto context = open_device(api, {});
    const Current current(*context);
    const Texture texture = make_texture(context->gl(), GL_TEXTURE_3D, "some volume");
    EXPECT_EQ(label, "some volume");
}

}  // namespace
}  // namespace raylign::detail::gl
