#include "core/io/geometry/dicom_orientation.h"

#include <cmath>

#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

std::vector<Eigen::Vector3d> directions_of(std::string_view letters, const std::string& text,
                                           const std::string& where) {
    std::vector<Eigen::Vector3d> directions;
    for (const char letter : letters) {
        switch (letter) {
            case 'L':
                directions.emplace_back(1, 0, 0);
                break;
            case 'R':
                directions.emplace_back(-1, 0, 0);
                break;
            case 'P':
                directions.emplace_back(0, 1, 0);
                break;
            case 'A':
                directions.emplace_back(0, -1, 0);
                break;
            case 'H':
                directions.emplace_back(0, 0, 1);
                break;
            case 'F':
                directions.emplace_back(0, 0, -1);
                break;
            default:
                throw bad_value("PatientOrientation (0020,0020)", text, "letters of A, P, L, R, H, F", where);
        }
    }
    return directions;
}

bool agrees(const std::vector<Eigen::Vector3d>& letters, const Eigen::Vector2d& axis_camera,
            const Eigen::Matrix3d& world_from_camera) {
    const Eigen::Vector3d axis_world = world_from_camera.leftCols<2>() * axis_camera;
    // The first letter names the nearest of six directions: at most 54.7 degrees off. Rounded angles may blur it.
    constexpr double kFirst = 0.5, kOthers = -0.02;
    for (std::size_t i = 0; i < letters.size(); ++i) {
        if (letters[i].dot(axis_world) < (i == 0 ? kFirst : kOthers)) return false;
    }
    return true;
}

}  // namespace

StoredOrientation orientation_of_field(double rotation_deg, bool flip) {
    StoredOrientation stored{-Eigen::Vector2d::UnitX(), Eigen::Vector2d::UnitY()};
    const int quarters = ((static_cast<int>(std::lround(rotation_deg / 90)) % 4) + 4) % 4;
    for (int i = 0; i < quarters; ++i) {  // clockwise: what was on top is now on the right
        const Eigen::Vector2d column = stored.column_camera;
        stored.column_camera = -stored.row_camera;
        stored.row_camera = column;
    }
    if (flip) stored.column_camera = -stored.column_camera;
    return stored;
}

PatientLabels patient_labels(const std::string& text, const std::string& where) {
    const std::vector<std::string_view> parts = split(text, '\\');
    if (text.empty() || (parts.size() == 2 && trimmed(parts[0]).empty() && trimmed(parts[1]).empty())) return {};
    if (parts.size() != 2 || trimmed(parts[0]).empty() || trimmed(parts[1]).empty()) {
        throw bad_value("PatientOrientation (0020,0020)", text, "two values, such as L\\F", where);
    }
    return {true, directions_of(trimmed(parts[0]), text, where), directions_of(trimmed(parts[1]), text, where)};
}

bool agrees(const PatientLabels& labels, const StoredOrientation& orientation,
            const Eigen::Matrix3d& world_from_camera) {
    return agrees(labels.column_ct, orientation.column_camera, world_from_camera) &&
           agrees(labels.row_ct, orientation.row_camera, world_from_camera);
}

StoredOrientation orientation_of_labels(const PatientLabels& labels, const Eigen::Matrix3d& world_from_camera,
                                        const std::string& where) {
    for (const bool flip : {false, true}) {
        for (int quarter = 0; quarter < 4; ++quarter) {
            const StoredOrientation candidate = orientation_of_field(90 * quarter, flip);
            if (agrees(labels, candidate, world_from_camera)) return candidate;
        }
    }
    throw Error("PatientOrientation (0020,0020) in " + where +
                " contradicts the positioner's angles: no turn or flip of the image runs along these directions");
}

Eigen::Vector2d stored_offset_px(const Eigen::Vector2d& from_corner_mm, const StoredOrientation& orientation,
                                 const Eigen::Vector2i& size_px, const Eigen::Vector2d& pitch_mm) {
    // Stored axes along the detector's: camera directions of both, the detector's columns run along camera -x.
    const Eigen::Matrix2d detector{{-1, 0}, {0, 1}};
    Eigen::Matrix2d stored;
    stored << orientation.column_camera.transpose(), orientation.row_camera.transpose();
    const Eigen::Matrix2d stored_from_detector = stored * detector.transpose();
    const Eigen::Vector2d size_mm = size_px.cast<double>().cwiseProduct(pitch_mm);
    const Eigen::Vector2d half_mm = (stored_from_detector.transpose() * size_mm).cwiseAbs() / 2;
    return (stored_from_detector * (from_corner_mm - half_mm)).cwiseQuotient(pitch_mm);
}

}  // namespace raylign::detail
