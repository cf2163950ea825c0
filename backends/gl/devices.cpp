#include "backends/gl/devices.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>

#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

std::optional<int> index_of(const std::string& wanted) {
    int index = 0;
    const auto [end, status] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (status != std::errc{} || end != wanted.data() + wanted.size()) return std::nullopt;
    return index;
}

bool contains(const std::string& text, const std::string& part) {
    const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
    return part.empty() || std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

/// Empty if the device is one that the choice allows.
std::string objection(const Device& device, const DeviceChoice& choice) {
    const bool named = contains(device.renderer, choice.wanted) || contains(device.vendor, choice.wanted) ||
                       contains(device.node, choice.wanted);
    if (!named && !index_of(choice.wanted)) return device.renderer + " is not " + choice.wanted;
    if (!device.software || choice.software_allowed) return {};
    return device.renderer + " runs on the processor: taken only when asked for by name (--backend gl)";
}

Error none(const DeviceChoice& choice, const std::vector<std::string>& reasons) {
    std::string message = choice.wanted.empty() ? "no OpenGL device can be used" : "no OpenGL device " + choice.wanted;
    for (const std::string& reason : reasons) message += "; " + reason;
    return Error(message, ErrorKind::unavailable);
}

}  // namespace

std::vector<DeviceEntry> list_devices(const Api& api) {
    std::vector<DeviceEntry> entries;
    for (const Display& display : list_displays(api)) {
        DeviceEntry entry{.index = static_cast<int>(entries.size()), .name = display_name(display)};
        try {
            entry.device = Context(api, display).device();
            entry.name = entry.device.renderer;
        } catch (const Error& error) {
            entry.problem = error.what();
        }
        entries.push_back(std::move(entry));
    }
    return entries;
}

std::shared_ptr<Context> open_device(const Api& api, const DeviceChoice& choice) {
    const std::vector<Display> displays = list_displays(api);
    const std::optional<int> index = index_of(choice.wanted);
    if (index && (*index < 0 || *index >= static_cast<int>(displays.size()))) {
        throw Error(bad_value("device", choice.wanted, "an index below " + std::to_string(displays.size())).what(),
                    ErrorKind::unavailable);
    }
    std::vector<std::string> reasons;
    for (std::size_t i = 0; i < displays.size(); ++i) {
        if (index && *index != static_cast<int>(i)) continue;
        if (displays[i].software && !choice.software_allowed) {  // known without the cost of a context
            reasons.push_back(display_name(displays[i]) +
                              " is software OpenGL: taken only when asked for by name (--backend gl)");
            continue;
        }
        try {
            auto context = std::make_shared<Context>(api, displays[i]);
            const std::string reason = objection(context->device(), choice);
            if (reason.empty()) return context;
            reasons.push_back(reason);
        } catch (const Error& error) {
            reasons.emplace_back(error.what());
        }
    }
    throw none(choice, reasons);
}

}  // namespace raylign::detail::gl
