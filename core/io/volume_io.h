#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/image/volume.h"

namespace raylign {

struct VolumeReadOptions {
    std::string hu_preset;        ///< name (core/image/intensity.h); "" = the default
    bool is_attenuation = false;  ///< voxels are 1/mm already
    double hu_offset = 0;         ///< added to the stored values to get HU: -1024 for CTs stored as HU + 1024
    std::string series;           ///< DICOM folder with several series: UID, or its number in the list
    std::optional<Eigen::Vector3d> spacing_mm;  ///< multi-page TIFF: its spacing
};

struct VolumeFile {
    Volume volume;
    std::vector<std::string> notes;            ///< what was decided: preset, series, clipped values, flipped axes
    std::vector<std::filesystem::path> files;  ///< every file read, for the report's hashes
};

/// Reads NIfTI, MHA/MHD, NRRD, a multi-page TIFF or a DICOM series' folder into LPS, honouring origin, spacing and
/// direction.
[[nodiscard]] VolumeFile read_volume(const std::filesystem::path& path, const VolumeReadOptions& options = {});

/// Writes attenuation [1/mm] as float32 (MHA, NRRD or NIfTI by the extension), to a temporary name first.
void write_volume(const std::filesystem::path& path, const Volume& volume);

}  // namespace raylign
