#pragma once

#include "backends/gl/api.h"

namespace raylign::detail::test {

/// `api` as a GPU's: nothing says that the device is software, so that the gl engine works with it as with hardware,
/// which waits at no stage. Its programs are not kept in the user's folder. One at a time.
inline gl::Api as_hardware(gl::Api api) {
    static decltype(api.gl.GetString) text = nullptr;
    static decltype(api.egl.QueryDeviceStringEXT) device_text = nullptr;
    text = api.gl.GetString;
    device_text = api.egl.QueryDeviceStringEXT;
    api.gl.GetString = [](GLenum name) -> const GLubyte* {
        return name == GL_RENDERER ? reinterpret_cast<const GLubyte*>("a GPU") : text(name);
    };
    static decltype(api.gl.GetProgramiv) program = nullptr;
    program = api.gl.GetProgramiv;
    api.gl.GetProgramiv = [](GLuint id, GLenum name, GLint* value) {
        name == GL_PROGRAM_BINARY_LENGTH ? void(*value = 0) : program(id, name, value);
    };
    if (device_text == nullptr) return api;
    api.egl.QueryDeviceStringEXT = [](EGLDeviceEXT device, EGLint name) -> const char* {
        return name == EGL_EXTENSIONS ? "" : device_text(device, name);
    };
    return api;
}

}  // namespace raylign::detail::test
