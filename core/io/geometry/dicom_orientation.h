#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace raylign::detail {

/// Along which camera directions (x, y in the detector's plane, unit vectors along the axes) the stored columns and
/// rows of an image run.
struct StoredOrientation {
    Eigen::Vector2d column_camera = Eigen::Vector2d::UnitX(), row_camera = Eigen::Vector2d::UnitY();

    /// Left-handed with the viewing direction: the image as seen from the detector, not from the source.
    [[nodiscard]] bool is_mirrored() const {
        return column_camera.x() * row_camera.y() - column_camera.y() * row_camera.x() < 0;
    }
};

/// FieldOfViewRotation (clockwise, in steps of 90 degrees), then FieldOfViewHorizontalFlip, of an image that an
/// observer at the detector sees: there columns run along camera -x and rows along camera y. Source: DICOM PS3.3
/// C.8.11.4.1.1 for the order; the observer's place is the display's custom (the patient's left on the right side),
/// which PatientOrientation overrules where the file has no field-of-view tags.
[[nodiscard]] StoredOrientation orientation_of_field(double rotation_deg, bool flip);

/// PatientOrientation: the patient's directions in which columns (first) and rows (second) run, most important first.
struct PatientLabels {
    bool is_given = false;
    std::vector<Eigen::Vector3d> column_ct, row_ct;  ///< unit vectors of LPS
};

/// Parses "L\F", "LA\FP", ... Empty text: not given. Throws Error for other letters.
[[nodiscard]] PatientLabels patient_labels(const std::string& text, const std::string& where);

/// Whether each letter's direction is within 90 degrees of the axis that it describes (the first: within 60).
[[nodiscard]] bool agrees(const PatientLabels& labels, const StoredOrientation& orientation,
                          const Eigen::Matrix3d& world_from_camera);

/// The one of the eight orientations that agrees. Throws Error where none does: the labels contradict the angles.
[[nodiscard]] StoredOrientation orientation_of_labels(const PatientLabels& labels,
                                                      const Eigen::Matrix3d& world_from_camera,
                                                      const std::string& where);

/// Where a point of the detector lies from the stored image's middle [px]: `from_corner_mm` is measured from the
/// field's top left corner along the detector's columns and rows, before rotation and flip.
[[nodiscard]] Eigen::Vector2d stored_offset_px(const Eigen::Vector2d& from_corner_mm,
                                               const StoredOrientation& orientation, const Eigen::Vector2i& size_px,
                                               const Eigen::Vector2d& pitch_mm);

}  // namespace raylign::detail
