#pragma once

#include <cstdlib>

#include "backends/gl/api.h"

namespace raylign::detail::test {

/// Functions in the place of OpenGL's own, by which software passes for a GPU.
struct AsHardware {
    static inline gl::Api real;

    static const GLubyte* get_string(GLenum name) {
        return name == GL_RENDERER ? reinterpret_cast<const GLubyte*>("a GPU") : real.gl.GetString(name);
    }
    static const char* device_string(EGLDeviceEXT device, EGLint name) {
        return name == EGL_EXTENSIONS ? "" : real.egl.QueryDeviceStringEXT(device, name);
    }
    /// Its programs are not kept in the user's folder.
    static void get_program(GLuint id, GLenum name, GLint* value) {
        name == GL_PROGRAM_BINARY_LENGTH ? void(*value = 0) : real.gl.GetProgramiv(id, name, value);
    }
};

/// `api` as a GPU's: nothing says that the device is software, so that the gl engine works with it as with hardware,
/// which waits at no stage. One at a time.
inline gl::Api as_hardware(gl::Api api) {
    if (api.gl.GetString == AsHardware::get_string) return api;
    AsHardware::real = api;
    api.gl.GetString = AsHardware::get_string;
    api.gl.GetProgramiv = AsHardware::get_program;
    if (api.egl.QueryDeviceStringEXT != nullptr) api.egl.QueryDeviceStringEXT = AsHardware::device_string;
    return api;
}

/// OpenGL; as hardware where the environment says so (RAYLIGN_TEST_AS_HARDWARE).
inline gl::Api load_api() {
    const gl::Api api = gl::load_api();
    return std::getenv("RAYLIGN_TEST_AS_HARDWARE") == nullptr ? api : as_hardware(api);
}

}  // namespace raylign::detail::test
