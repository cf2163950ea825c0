#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "raylign/grid.h"

namespace raylign::detail {

/// What the tags of one DICOM file say of its slice's place (LPS, mm).
struct DicomSlice {
    std::filesystem::path path;
    Eigen::Vector2i size = Eigen::Vector2i::Zero();  ///< columns, rows
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis_x = Eigen::Vector3d::Zero(), axis_y = Eigen::Vector3d::Zero();
    Eigen::Vector2d pitch_mm = Eigen::Vector2d::Zero();
    /// false: position, orientation or pixel spacing is missing (a multi-frame file's are elsewhere).
    bool has_place = false;
};

struct DicomSeries {
    std::string uid, description;
    double number = 0;
    std::vector<DicomSlice> slices;
};

struct DicomFolder {
    std::vector<DicomSeries> series;  ///< by series number, then UID
    std::size_t ignored_files = 0;    ///< not DICOM, or DICOM without an image
};

/// Reads the tags of every file in the folder (not of sub-folders). Throws Error for a folder without DICOM images and
/// for a DICOM file that is cut off within its tags.
[[nodiscard]] DicomFolder scan_dicom_folder(const std::filesystem::path& folder);

/// The series named by `choice`: its UID or its number in the list, from 1; "" where there is but one. Throws Error
/// listing them (UID, description, slices).
[[nodiscard]] const DicomSeries& choose_series(const DicomFolder& found, const std::string& choice,
                                               const std::filesystem::path& folder);

/// Sorts the slices along their normal and returns their lattice. Throws Error for slices that differ in size or
/// orientation, stand at one place, are missing (a gap), or are stacked askew (gantry tilt).
[[nodiscard]] VoxelGrid stack_slices(DicomSeries& series);

}  // namespace raylign::detail
