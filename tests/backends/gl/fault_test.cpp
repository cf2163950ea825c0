// What the machine cannot provoke, put into the table of functions.

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "gl_scenes.h"
#include "tests/support/errors.h"

namespace raylign::detail::gl {
namespace {

std::string fault_of(const std::function<void()>& work) { return test::error_of(work, ErrorKind::unavailable); }

TEST(GlFaults, AShaderThatDoesNotCompileStopsThePreparedSessionWithTheLog) {
    RAYLIGN_NEED_GL(api);
    static decltype(api.gl.GetShaderiv) real = nullptr;
    real = api.gl.GetShaderiv;
    api.gl.GetShaderiv = [](GLuint shader, GLenum name, GLint* value) {
        name == GL_COMPILE_STATUS ? void(*value = GL_FALSE) : real(shader, name, value);
    };
    api.gl.GetShaderInfoLog = [](GLuint, GLsizei size, GLsizei* length, GLchar* text) {
        *length = std::snprintf(text, size, "%s", "");
    };
    const test::SpineScene spine;
    const auto session = make_gl_backend(api, {})->prepare(spine.scene());
    const std::string message = fault_of([&] { (void)test::costs(*session, spine.poses(1)); });
    EXPECT_NE(message.find(".comp does not compile"), std::string::npos) << message;
}

TEST(GlFaults, AVolumeWithoutMemoryIsRefusedWithItsSize) {
    RAYLIGN_NEED_GL(api);
    static bool fails = false;
    static decltype(api.gl.GetError) real = nullptr;
    real = api.gl.GetError;
    api.gl.TextureStorage3D = [](GLuint, GLsizei, GLenum, GLsizei, GLsizei, GLsizei) { fails = true; };
    api.gl.GetError = [] { return std::exchange(fails, false) ? GL_OUT_OF_MEMORY : real(); };
    const test::SpineScene spine(64);
    const std::string message = fault_of([&] { (void)make_gl_backend(api, {})->prepare(spine.scene()); });
    EXPECT_NE(message.find("64 x 64 x 64"), std::string::npos) << message;
    EXPECT_NE(message.find("no memory"), std::string::npos) << message;
}

TEST(GlFaults, BuffersWithoutMemoryAreRefusedWithTheirSize) {
    RAYLIGN_NEED_GL(api);
    static bool fails = false;
    static decltype(api.gl.GetError) real = nullptr;
    real = api.gl.GetError;
    api.gl.NamedBufferStorage = [](GLuint, GLsizeiptr, const void*, GLbitfield) { fails = true; };
    api.gl.GetError = [] { return std::exchange(fails, false) ? GL_OUT_OF_MEMORY : real(); };
    const test::SpineScene spine;
    const std::string message = fault_of([&] { (void)make_gl_backend(api, {})->prepare(spine.scene()); });
    EXPECT_NE(message.find("has no memory for scene"), std::string::npos) << message;
}

TEST(GlFaults, ALostContextIsReportedAndANewSessionWorks) {
    RAYLIGN_NEED_GL(api);
    static bool lost = false;
    lost = false;
    static decltype(api.gl.GetGraphicsResetStatus) real = nullptr;
    real = api.gl.GetGraphicsResetStatus;
    api.gl.GetGraphicsResetStatus = [] { return lost ? GLenum{GL_INNOCENT_CONTEXT_RESET} : real(); };
    const test::SpineScene spine;
    const auto backend = make_gl_backend(api, {});
    const auto session = backend->prepare(spine.scene());
    const auto before = test::costs(*session, spine.poses(2));
    lost = true;
    EXPECT_NE(fault_of([&] { (void)test::costs(*session, spine.poses(2)); }).find("was reset"), std::string::npos);
    lost = false;  // the device is back, but this context stays lost
    EXPECT_NE(fault_of([&] { (void)test::costs(*session, spine.poses(2)); }).find("was reset"), std::string::npos);
    const auto again = backend->prepare(spine.scene());
    EXPECT_EQ(test::costs(*again, spine.poses(2)), before);
}

TEST(GlFaults, ADeviceThatHangsIsReportedWhenItIsReset) {
    RAYLIGN_NEED_GL(api);
    static bool hangs = false;
    hangs = false;
    static decltype(api.gl.GetGraphicsResetStatus) real = nullptr;
    static decltype(api.gl.ClientWaitSync) real_wait = nullptr;
    real = api.gl.GetGraphicsResetStatus;
    real_wait = api.gl.ClientWaitSync;
    api.gl.GetGraphicsResetStatus = [] { return hangs ? GLenum{GL_GUILTY_CONTEXT_RESET} : real(); };
    api.gl.ClientWaitSync = [](GLsync sync, GLbitfield flags, GLuint64 timeout) {
        return hangs ? GLenum{GL_TIMEOUT_EXPIRED} : real_wait(sync, flags, timeout);
    };
    const test::SpineScene spine;
    const auto session = make_gl_backend(api, {})->prepare(spine.scene());
    hangs = true;
    EXPECT_NE(fault_of([&] { (void)test::costs(*session, spine.poses(1)); }).find("was reset"), std::string::npos);
}

TEST(GlFaults, AnErrorOfOpenGlIsNotSwallowed) {
    RAYLIGN_NEED_GL(api);
    static bool fails = false;
    fails = false;
    static decltype(api.gl.GetError) real = nullptr;
    real = api.gl.GetError;
    api.gl.GetError = [] { return std::exchange(fails, false) ? GL_INVALID_OPERATION : real(); };
    const test::SpineScene spine;
    const auto session = make_gl_backend(api, {})->prepare(spine.scene());
    fails = true;
    EXPECT_NE(fault_of([&] { (void)test::costs(*session, spine.poses(1)); }).find("invalid operation"),
              std::string::npos);
}

}  // namespace
}  // namespace raylign::detail::gl
