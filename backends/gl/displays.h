#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "backends/gl/api.h"

namespace raylign::detail::gl {

/// A way to reach OpenGL without a window: an EGL device, or one of the two displays that need none.
struct Display {
    enum class Kind { device, surfaceless, standard };
    Kind kind = Kind::device;
    EGLDeviceEXT device = EGL_NO_DEVICE_EXT;
    std::string node;       ///< "/dev/dri/renderD128", where the device has one
    bool software = false;  ///< marked so by EGL; the renderer's name tells of others
};

/// The devices of this machine, hardware first; where EGL lists none, the surfaceless and the standard display.
[[nodiscard]] std::vector<Display> list_displays(const Api& api);

/// Its EGLDisplay, initialised, or EGL_NO_DISPLAY. One per process and display; it is never terminated, since other
/// contexts of the process may use it.
[[nodiscard]] EGLDisplay open_display(const Api& api, const Display& display);

/// For messages: "EGL device", "surfaceless display" ...
[[nodiscard]] std::string display_name(const Display& display);

/// Is `name` in a list of extensions separated by blanks (which may be null)?
[[nodiscard]] bool has_extension(const char* extensions, std::string_view name);

}  // namespace raylign::detail::gl
