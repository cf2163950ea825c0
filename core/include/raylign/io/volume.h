#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "raylign/grid.h"
#include "raylign/volume.h"

namespace raylign {

/// The part of the CT that is the object: the rest becomes 0, and the volume is cropped to what is left. Applied in
/// this order. HU are 1/mm where the voxels are.
struct ObjectRegion {
    std::optional<double> clip_hu;            ///< voxels above are lowered to it: metal
    std::filesystem::path label_map;          ///< "" = none
    std::vector<std::int32_t> labels;         ///< of the map to keep; none, and no names = all but 0
    std::vector<std::string> label_names;     ///< the same by name, of `label_table`, else of the map itself, else of
                                              ///< TotalSegmentator's task `total`, version 2
    std::filesystem::path label_table;        ///< CSV number,name, or 3D Slicer's or ITK-SNAP's labels; "" = none
    std::optional<CtBox> box_mm;              ///< voxels whose centres lie inside are kept, fading out over 4 mm
    std::optional<VoxelBox> box_voxels;       ///< the same by voxel indices
    std::optional<double> bone_threshold_hu;  ///< voxels count by what they exceed it by, at least 0

    [[nodiscard]] bool is_whole() const {
        return !clip_hu && label_map.empty() && !box_mm && !box_voxels && !bone_threshold_hu;
    }
};

/// How a CT is read.
struct VolumeReadOptions {
    std::string hu_preset;        ///< name (raylign/intensity.h); "" = the default
    bool is_attenuation = false;  ///< voxels are 1/mm already
    double hu_offset = 0;         ///< added to the stored values to get HU: -1024 for CTs stored as HU + 1024
    std::string series;           ///< DICOM folder with several series: UID, or its number in the list
    std::optional<Eigen::Vector3d> spacing_mm;  ///< multi-page TIFF: its spacing
    ObjectRegion object;                        ///< default: the whole CT
    // Of a model, a surface of triangles that is filled:
    std::string material;   ///< cobalt-chrome, titanium, steel, polyethylene, bone, HU=N or MU=N (1/mm); must be given
    std::string mesh_unit;  ///< mm, cm, m or in; "" = mm, and sizes that are unlikely then are named or refused
    std::optional<double> mesh_spacing_mm;           ///< side of its voxels, in (0, 10]
    std::optional<double> proposed_mesh_spacing_mm;  ///< where that is not given; default: 256 voxels along the model
    bool keeps_surface = true;                       ///< Volume::surface is set, for exact DRRs; false: voxels alone
};

/// A CT, and what was decided on reading it.
struct VolumeFile {
    Volume volume;
    VoxelGrid file_grid;                       ///< of all of the file, before the object was cut out
    std::vector<std::string> notes;            ///< what was decided: preset, series, clipped values, flipped axes
    std::vector<std::filesystem::path> files;  ///< every file read, for the report's hashes
};

/// Reads NIfTI, MHA/MHD, NRRD, a multi-page TIFF or a DICOM series' folder into LPS [mm], honouring origin, spacing and
/// direction; HU become attenuation [1/mm]. Or fills a model: STL, OBJ, PLY, or JSON with several parts; ct is then its
/// own frame, and a voxel has the attenuation of the material times the share that is inside. Throws Error for a file
/// that is missing, damaged or cut off, a surface that is open, and options that do not fit it.
[[nodiscard]] VolumeFile read_volume(const std::filesystem::path& path, const VolumeReadOptions& options = {});

/// True for files that read_volume fills as models: .stl, .obj, .ply, .json.
[[nodiscard]] bool is_model(const std::filesystem::path& path);

/// The middle of a model's box [mm, its own frame], for those who choose a spacing by where it is seen. Throws Error as
/// read_volume does.
[[nodiscard]] Eigen::Vector3d model_centre_mm(const std::filesystem::path& path, const VolumeReadOptions& options);

/// Reads a label map: whole numbers in any of these formats, on a grid of its own. A TIFF has the grid of `like`, whose
/// size it must have. Throws Error for fractions and for numbers beyond 32 bits.
[[nodiscard]] LabelMap read_label_map(const std::filesystem::path& path, const VoxelGrid& like);

/// Writes attenuation [1/mm] as float32 (MHA, NRRD or NIfTI by the extension), to a temporary name first.
void write_volume(const std::filesystem::path& path, const Volume& volume);

}  // namespace raylign
