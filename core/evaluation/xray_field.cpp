#include <algorithm>
#include <cmath>

#include "core/evaluation/xray_parts.h"

namespace raylign::detail {
namespace {

constexpr float kThroughBlades = 0.003F;  // a few mm of lead and what scatters around them
constexpr float kThroughMarker = 0.05F;   // 1 mm of lead, and the scatter that reaches the detector under it

bool in_letter_l(double x, double y) {  // within its box, y down, both in [0, 1]
    return x >= 0 && x <= 0.6 && y >= 0 && y <= 1 && (x <= 0.2 || y >= 0.8);
}

}  // namespace

Image field_transmission(const XrayModel& model, int width, int height) {
    Image field(width, height, 1);
    const double radius = model.round_field_share * std::min(width, height) / 2;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double from_side_x = std::min(x, width - 1 - x) + 0.5,
                         from_side_y = std::min(y, height - 1 - y) + 0.5;
            const bool bladed =
                from_side_x < model.blade_share.x() * width || from_side_y < model.blade_share.y() * height;
            const double distance = std::hypot(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0);
            if (bladed || (radius > 0 && distance > radius)) field(x, y) = kThroughBlades;
        }
    }
    return field;
}

Image marker_transmission(const XrayModel& model, int width, int height) {
    Image lead(width, height, 1);
    const double size = model.marker_share * std::min(width, height);
    if (size == 0) return lead;
    constexpr double kPlace = 0.22;  // from the upper left: inside a round field, too
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (in_letter_l((x + 0.5 - kPlace * width) / size, (y + 0.5 - kPlace * height) / size))
                lead(x, y) = kThroughMarker;
        }
    }
    return lead;
}

}  // namespace raylign::detail
