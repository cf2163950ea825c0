#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backends/gl/context.h"

namespace raylign::detail::gl {

/// Which device to take.
struct DeviceChoice {
    std::string wanted;            ///< its index in list_devices, or a part of its renderer's name, vendor or node
    bool software_allowed = true;  ///< take software OpenGL where there is no hardware
};

struct DeviceEntry {
    int index = 0;
    std::string name;  ///< the renderer's, or what the display is called where it cannot be used
    Device device;     ///< valid where it can be used
    std::string problem;
};

/// All devices and why one cannot be used. Makes a context on each: some 10 to 300 ms a device.
[[nodiscard]] std::vector<DeviceEntry> list_devices(const Api& api);

/// A context on the wanted device, or on the first that works, hardware first. Throws Error, kind unavailable, with the
/// reason of each device passed over.
[[nodiscard]] std::shared_ptr<Context> open_device(const Api& api, const DeviceChoice& choice);

}  // namespace raylign::detail::gl
