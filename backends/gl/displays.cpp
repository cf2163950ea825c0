#include "backends/gl/displays.h"

#include <algorithm>

namespace raylign::detail::gl {
namespace {

std::vector<Display> displays_of_devices(const Api& api) {
    if (api.egl.QueryDevicesEXT == nullptr || api.egl.GetPlatformDisplayEXT == nullptr) return {};
    EGLint count = 0;
    if (!api.egl.QueryDevicesEXT(0, nullptr, &count) || count <= 0) return {};
    std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
    if (!api.egl.QueryDevicesEXT(count, devices.data(), &count)) return {};
    devices.resize(static_cast<std::size_t>(std::max(count, 0)));
    std::vector<Display> displays;
    for (const EGLDeviceEXT device : devices) {
        Display display{.kind = Display::Kind::device, .device = device};
        if (api.egl.QueryDeviceStringEXT != nullptr) {
            const char* extensions = api.egl.QueryDeviceStringEXT(device, EGL_EXTENSIONS);
            display.software = has_extension(extensions, "EGL_MESA_device_software");
            if (has_extension(extensions, "EGL_EXT_device_drm_render_node")) {
                const char* node = api.egl.QueryDeviceStringEXT(device, EGL_DRM_RENDER_NODE_FILE_EXT);
                if (node != nullptr) display.node = node;
            }
        }
        displays.push_back(display);
    }
    std::stable_partition(displays.begin(), displays.end(), [](const Display& display) { return !display.software; });
    return displays;
}

}  // namespace

bool has_extension(const char* extensions, std::string_view name) {
    std::string_view rest = extensions == nullptr ? "" : extensions;
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find(' '), rest.size());
        if (rest.substr(0, end) == name) return true;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return false;
}

std::vector<Display> list_displays(const Api& api) {
    std::vector<Display> displays = displays_of_devices(api);
    if (!displays.empty()) return displays;
    const char* client = api.egl.QueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (api.egl.GetPlatformDisplayEXT != nullptr && has_extension(client, "EGL_MESA_platform_surfaceless")) {
        displays.push_back({.kind = Display::Kind::surfaceless});
    }
    displays.push_back({.kind = Display::Kind::standard});
    return displays;
}

EGLDisplay open_display(const Api& api, const Display& display) {
    EGLDisplay opened = EGL_NO_DISPLAY;
    switch (display.kind) {
        case Display::Kind::device:
            opened = api.egl.GetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, display.device, nullptr);
            break;
        case Display::Kind::surfaceless:
            opened = api.egl.GetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
            break;
        case Display::Kind::standard:
            opened = api.egl.GetDisplay(EGL_DEFAULT_DISPLAY);
            break;
    }
    EGLint major = 0, minor = 0;
    if (opened == EGL_NO_DISPLAY || !api.egl.Initialize(opened, &major, &minor)) return EGL_NO_DISPLAY;
    return opened;
}

std::string display_name(const Display& display) {
    if (display.kind == Display::Kind::surfaceless) return "surfaceless display";
    if (display.kind == Display::Kind::standard) return "default display";
    return display.node.empty() ? "EGL device" : "EGL device " + display.node;
}

}  // namespace raylign::detail::gl
