#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "core/io/dicom/pixel_layout.h"
#include "core/io/dicom/pixel_values.h"

namespace raylign::detail {

/// What a DICOM file says of one of its frames (most files have one): its place (LPS, mm) and how it is stored.
struct DicomSlice {
    std::filesystem::path path;
    int frame = 0;  ///< from 0
    PixelLayout layout;
    PixelValues values;
    std::string why_no_ct;           ///< "" = it is one
    std::string frame_of_reference;  ///< UID; "" = not said
    Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d axis_x = Eigen::Vector3d::Zero(), axis_y = Eigen::Vector3d::Zero();
    Eigen::Vector2d pitch_mm = Eigen::Vector2d::Zero();
    bool has_place = false;  ///< false: position, orientation or pixel spacing is missing
};

/// The slices of one stack: of a series, or of a part of it that the file names (stack, point in time).
struct DicomSeries {
    std::string uid, description;
    double number = 0;
    std::vector<DicomSlice> slices;

    [[nodiscard]] bool is_ct() const;             ///< any of its slices is
    [[nodiscard]] std::string file_text() const;  ///< "20 slices" or "20 frames of 2 files"
};

struct DicomFolder {
    std::filesystem::path path;
    std::vector<DicomSeries> series;  ///< by series number, then UID
    std::size_t ignored_files = 0;    ///< not DICOM, or DICOM without an image
    std::size_t empty_files = 0;      ///< of these, of 0 bytes
    std::size_t localizers = 0;       ///< scout views, left out
};

/// Reads the tags of every file in the folder (not of sub-folders), or of one file. Throws Error for a folder without
/// DICOM images, naming the folders within it that have some, and for a DICOM file that is cut off within its tags.
[[nodiscard]] DicomFolder scan_dicom(const std::filesystem::path& path);

/// The series named by `choice`: its UID or its number in the list, from 1; "" where there is but one, or one that is a
/// CT. Throws Error listing them (UID, description, slices).
[[nodiscard]] const DicomSeries& choose_series(const DicomFolder& found, const std::string& choice);

/// What was taken and what was left out, for the report.
[[nodiscard]] std::vector<std::string> folder_notes(const DicomFolder& found, const DicomSeries& series);

}  // namespace raylign::detail
