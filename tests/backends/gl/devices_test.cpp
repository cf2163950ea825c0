#include <gtest/gtest.h>

#include "backends/gl/devices.h"
#include "core/base/error.h"
#include "gl_scenes.h"
#include "tests/support/errors.h"

namespace raylign::detail::gl {
namespace {

std::string refusal_of(const std::function<void()>& work) { return test::error_of(work, ErrorKind::unavailable); }

TEST(GlApi, AMissingLibraryIsNamed) {
    const std::string message = refusal_of([] { (void)load_api("libNoSuchEGL.so.7"); });
    EXPECT_NE(message.find("libNoSuchEGL.so.7"), std::string::npos) << message;
    EXPECT_NE(message.find("libegl1"), std::string::npos) << "says what to install: " << message;
}

TEST(GlApi, ALibraryThatIsNotEglIsRefused) {
    const std::string message = refusal_of([] { (void)load_api("libm.so.6"); });
    EXPECT_NE(message.find("eglGetProcAddress"), std::string::npos) << message;
}

TEST(GlExtensions, AreFoundAsWholeWords) {
    EXPECT_TRUE(has_extension("EGL_A EGL_B", "EGL_A"));
    EXPECT_TRUE(has_extension("EGL_A EGL_B", "EGL_B"));
    EXPECT_FALSE(has_extension("EGL_AB EGL_BA", "EGL_A"));
    EXPECT_FALSE(has_extension("", "EGL_A"));
    EXPECT_FALSE(has_extension(nullptr, "EGL_A"));
}

TEST(GlDevices, AreListedWithTheirLimits) {
    RAYLIGN_NEED_GL(api);
    const auto devices = list_devices(api);
    ASSERT_FALSE(devices.empty());
    bool software_seen = false;
    for (const DeviceEntry& entry : devices) {
        EXPECT_EQ(entry.index, &entry - devices.data());
        if (!entry.problem.empty()) continue;
        EXPECT_FALSE(entry.device.renderer.empty());
        EXPECT_GE(entry.device.limits.texture_3d, 2048) << "what OpenGL 4.5 promises";
        EXPECT_GE(entry.device.limits.texture_layers, 2048);
        EXPECT_TRUE(entry.device.software || !software_seen) << "hardware first";
        software_seen |= entry.device.software;
    }
}

TEST(GlDevices, AreChosenByIndexOrPartOfTheName) {
    RAYLIGN_NEED_GL(api);
    const std::string name = open_device(api, {})->device().renderer;
    for (const DeviceEntry& entry : list_devices(api)) {
        if (entry.problem.empty()) {
            EXPECT_EQ(open_device(api, {std::to_string(entry.index)})->device().renderer, entry.name);
        }
    }
    std::string part = name.substr(1, 5);
    for (char& c : part) c = static_cast<char>(std::toupper(c));
    EXPECT_EQ(open_device(api, {part})->device().renderer, name) << part;
}

TEST(GlDevices, OneThatIsNotThereIsRefusedWithWhatIs) {
    RAYLIGN_NEED_GL(api);
    const std::string by_index = refusal_of([&] { (void)open_device(api, {"97"}); });
    EXPECT_NE(by_index.find("97"), std::string::npos) << by_index;
    const std::string by_name = refusal_of([&] { (void)open_device(api, {"Voodoo 2"}); });
    EXPECT_NE(by_name.find("Voodoo 2"), std::string::npos) << by_name;
    EXPECT_NE(by_name.find(open_device(api, {})->device().renderer), std::string::npos) << by_name;
    EXPECT_FALSE(refusal_of([&] { (void)open_device(api, {"-1"}); }).empty());
    EXPECT_FALSE(refusal_of([&] { (void)open_device(api, {"99999999999999"}); }).empty());
}

TEST(GlDevices, SoftwareIsTakenOnlyByName) {
    RAYLIGN_NEED_GL(api);
    for (const DeviceEntry& entry : list_devices(api)) {
        if (!entry.problem.empty()) continue;
        const DeviceChoice choice{std::to_string(entry.index), false};
        if (entry.device.software) {
            EXPECT_NE(refusal_of([&] { (void)open_device(api, choice); }).find("asked for by name"), std::string::npos);
        } else {
            EXPECT_NO_THROW((void)open_device(api, choice));
        }
    }
}

TEST(GlDevices, SoftwareThatEglDoesNotMarkIsKnownByItsName) {
    RAYLIGN_NEED_GL(api);
    if (!open_device(api, {})->device().software) GTEST_SKIP() << "needs software OpenGL alone";
    api.egl.QueryDeviceStringEXT = nullptr;
    EXPECT_TRUE(open_device(api, {})->device().software);
    EXPECT_NE(refusal_of([&] { (void)open_device(api, {"", false}); }).find("asked for by name"), std::string::npos);
}

TEST(GlDevices, WithoutDeviceExtensionsTheOtherDisplaysServe) {
    RAYLIGN_NEED_GL(api);
    api.egl.QueryDevicesEXT = nullptr;
    EXPECT_FALSE(open_device(api, {})->device().renderer.empty());
}

EGLBoolean EGLAPIENTRY no_devices(EGLint, EGLDeviceEXT*, EGLint* count) {
    *count = 0;
    return EGL_TRUE;
}
EGLBoolean EGLAPIENTRY cannot_initialise(EGLDisplay, EGLint*, EGLint*) { return EGL_FALSE; }
EGLContext EGLAPIENTRY cannot_create(EGLDisplay, EGLConfig, EGLContext, const EGLint*) { return EGL_NO_CONTEXT; }

TEST(GlDevices, NoDeviceAtAllSaysWhatWasTried) {
    RAYLIGN_NEED_GL(api);
    api.egl.QueryDevicesEXT = no_devices;
    api.egl.Initialize = cannot_initialise;
    const std::string message = refusal_of([&] { (void)open_device(api, {}); });
    EXPECT_NE(message.find("no OpenGL device can be used"), std::string::npos) << message;
    EXPECT_NE(message.find("default display"), std::string::npos) << message;
    for (const DeviceEntry& entry : list_devices(api)) EXPECT_FALSE(entry.problem.empty());
}

TEST(GlDevices, ADriverThatIsTooOldIsRefused) {
    RAYLIGN_NEED_GL(api);
    Api refuses = api;
    refuses.egl.CreateContext = cannot_create;
    EXPECT_NE(refusal_of([&] { (void)open_device(refuses, {}); }).find("4.5"), std::string::npos);

    static decltype(api.gl.GetIntegerv) real = nullptr;
    real = api.gl.GetIntegerv;
    api.gl.GetIntegerv = [](GLenum name, GLint* value) {
        name == GL_MINOR_VERSION ? void(*value = 2) : real(name, value);
    };
    const std::string message = refusal_of([&] { (void)open_device(api, {}); });
    EXPECT_NE(message.find("has OpenGL 4.2, 4.5 is needed"), std::string::npos) << message;
}

}  // namespace
}  // namespace raylign::detail::gl
