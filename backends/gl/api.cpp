#include "backends/gl/api.h"

#include <dlfcn.h>

#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

/// A new text for the loader's message, which names the file: "libEGL.so.1: cannot open shared object file: ...".
Error missing(const std::string& what) {
    return Error("OpenGL cannot be used: " + what + " (on Debian: libegl1, and a driver such as libgl1-mesa-dri)",
                 ErrorKind::unavailable);
}

}  // namespace

Api load_api(const std::string& library) {
    void* const handle = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) {
        const char* reason = dlerror();
        throw missing(reason != nullptr ? reason : "cannot open " + library);
    }
    const auto get = reinterpret_cast<decltype(&::eglGetProcAddress)>(dlsym(handle, "eglGetProcAddress"));
    if (get == nullptr) throw missing(library + " has no eglGetProcAddress");
    Api api;
    const auto look_up = [&](auto& function, const char* name, bool needed) {
        using Function = std::remove_reference_t<decltype(function)>;
        function = reinterpret_cast<Function>(get(name));
        // Before EGL 1.5, eglGetProcAddress may know extensions only.
        if (function == nullptr) function = reinterpret_cast<Function>(dlsym(handle, name));
        if (function == nullptr && needed) throw missing(library + " has no " + name);
    };
#define RAYLIGN_LOOK_UP(name) look_up(api.egl.name, "egl" #name, true);
    RAYLIGN_EGL_FUNCTIONS(RAYLIGN_LOOK_UP)
#undef RAYLIGN_LOOK_UP
#define RAYLIGN_LOOK_UP(name) look_up(api.egl.name, "egl" #name, false);
    RAYLIGN_EGL_EXTENSIONS(RAYLIGN_LOOK_UP)
#undef RAYLIGN_LOOK_UP
#define RAYLIGN_LOOK_UP(name) look_up(api.gl.name, "gl" #name, true);
    RAYLIGN_GL_FUNCTIONS(RAYLIGN_LOOK_UP)
#undef RAYLIGN_LOOK_UP
    return api;
}

}  // namespace raylign::detail::gl
