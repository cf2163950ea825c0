#include <array>
#include <cmath>

#include "raylign/tracking.h"

namespace raylign {

std::string_view status_name(TrackStatus status) {
    constexpr std::array<std::string_view, 5> kNames{"ok", "doubtful", "lost", "missing", "stopped"};
    return kNames[static_cast<std::size_t>(status)];
}

std::string TrackOptions::problem() const {
    if (max_jump_mm && !(*max_jump_mm > 0 && *max_jump_mm <= 1000)) return "max_jump_mm: must be in (0, 1000]";
    if (!(frame_step > 0 && std::isfinite(frame_step))) return "frame_step: must be positive and finite";
    if (depth_change_mm && !(*depth_change_mm > 0 && *depth_change_mm <= 1000)) {
        return "depth_change_mm: must be in (0, 1000]";
    }
    return {};
}

}  // namespace raylign
