#include <cmath>
#include <numbers>
#include <string>

#include "core/io/files/text.h"
#include "raylign/io/geometry.h"

namespace raylign {
using namespace detail;
namespace {

/// What is usual of a length, and what a slip of its unit would have made of it.
struct UsualLength {
    const char* what;
    double least_mm, most_mm;
};

// A micro-CT's source stands 100 mm from its detector, a chest stand's 3 m. Pixels: 5 um to 10 mm. Images: 10 mm to 2
// m.
constexpr UsualLength kSdd{"the detector is", 100, 10000};
constexpr UsualLength kPitch{"a pixel is", 0.005, 10};
constexpr UsualLength kImage{"the image on the detector is", 10, 2000};
constexpr UsualLength kOrigin{"the world's origin is", 20, 20000};
constexpr double kSource_mm = 1e-3;  // an origin nearer to the source is the source: a camera's own frame

bool is_usual(double value_mm, const UsualLength& usual) {
    return value_mm >= usual.least_mm && value_mm <= usual.most_mm;
}

void doubt_length(double value_mm, const UsualLength& usual, const std::string& more,
                  std::vector<std::string>& doubts) {
    if (is_usual(value_mm, usual)) return;
    std::string text = usual.what + (" " + number_text(value_mm)) + " mm" + more + ", usual are " +
                       number_text(usual.least_mm) + " to " + number_text(usual.most_mm) + " mm";
    for (const auto& [factor, unit] : {std::pair{1000.0, "metres"}, {0.001, "micrometres"}, {10.0, "centimetres"}}) {
        if (!is_usual(value_mm * factor, usual)) continue;
        text += ": was it given in " + std::string(unit) + "?";
        break;
    }
    doubts.push_back(text);
}

}  // namespace

std::vector<std::string> geometry_doubts(const ViewGeometry& view) {
    std::vector<std::string> doubts;
    const Camera& camera = view.camera;
    const Eigen::Vector2d size = camera.size_px.cast<double>();
    const Eigen::Vector2d focal_px(camera.intrinsics_px(0, 0), camera.intrinsics_px(1, 1));
    if (camera.sdd_mm) {
        const Eigen::Vector2d pitch = *camera.pixel_pitch_mm();
        doubt_length(*camera.sdd_mm, kSdd, " from the source", doubts);
        doubt_length(pitch.x(), kPitch, " wide", doubts);
        if (is_usual(pitch.x(), kPitch)) doubt_length(pitch.x() * size.x(), kImage, " wide", doubts);
    }
    const double origin_mm = view.camera_from_world.translation_mm.norm();
    if (origin_mm > kSource_mm) doubt_length(origin_mm, kOrigin, " from the source", doubts);
    const double angle_deg = 2 * std::atan(0.5 * size.x() / focal_px.x()) * 180 / std::numbers::pi;
    if (angle_deg > 120 || angle_deg < 0.1) {
        doubts.push_back("the image spans " + number_text(std::round(angle_deg * 100) / 100) +
                         " degrees seen from the source (focal length " + number_text(focal_px.x()) + " px, width " +
                         number_text(size.x()) +
                         " px), usual are 1 to 60: do source to detector and pixels have one unit, and is the focal "
                         "length in pixels?");
    }
    const double ratio = focal_px.y() / focal_px.x();
    if (!(ratio > 0.2 && ratio < 5)) {
        doubts.push_back("pixels are " + number_text(ratio) + " times as wide as high");
    }
    const Eigen::Vector2d off = (camera.intrinsics_px.topRightCorner<2, 1>() - size / 2).cwiseQuotient(size);
    if (off.cwiseAbs().maxCoeff() > 2) {
        doubts.push_back("the central ray meets the detector at pixel (" + number_text(camera.intrinsics_px(0, 2)) +
                         ", " + number_text(camera.intrinsics_px(1, 2)) + "), far outside the image: is it in mm?");
    }
    return doubts;
}

}  // namespace raylign
