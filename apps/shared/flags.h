#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/shared/help.h"

namespace CLI {
class App;
}

namespace raylign::detail::apps {

// The blocks of flags that command lines are made of. Each command has those that it heeds, and no others.

struct VolumeFlags {
    std::filesystem::path file;
    std::string hu_preset;  ///< "" = the default preset
    double hu_offset = 0;   ///< added to the stored values
    bool attenuation = false;
    std::string series;
    std::string spacing;                         ///< "X,Y,Z" [mm]; "" = from the file
    std::filesystem::path labels;                ///< label map; "" = none
    std::vector<std::string> label;              ///< of the map, to keep, by number or name; none = all but 0
    std::filesystem::path label_table;           ///< names of labels; "" = the map's own, or TotalSegmentator's
    std::string object;                          ///< "X0,Y0,Z0,X1,Y1,Z1" [ct mm], or voxels:...; "" = the whole CT
    std::optional<double> bone_threshold, clip;  ///< HU (1/mm with attenuation)
    std::vector<std::string> materials;          ///< of a model: MATERIAL, or NAME=MATERIAL for one of several objects
    double mesh_spacing_mm = 0;                  ///< of a model's voxels; 0 = by the views
    std::string mesh_drr;                        ///< of a model: triangles or voxels; "" = triangles
    std::string mesh_unit;                       ///< of a model; "" = mm
};

struct BackendFlags {
    std::string name = "auto";  ///< of several backends in turn: a list with commas, or "" = as the command says
    std::string device;
    int threads = 0;                          ///< 0 = all cores
    std::string storage;                      ///< float32 or int16; "" = the backend's own choice
    std::string interpolation;                ///< gl: hardware or exact; "" = hardware
    std::string solver;                       ///< gl: host or device; "" = host
    bool crop = false;                        ///< gl: keep only the box around the object
    std::string slices, reduction, readback;  ///< gl-2006: baselines of the paper; "" = its own way
    std::string projector = "joseph";
    double step_mm = 0;  ///< 0 = half the smallest voxel side
};

struct ViewFlags {
    std::vector<std::string> files;  ///< views.json or geometry files, each FILE or FILE=IMAGE
    std::string undistorted;         ///< "true" or "false": of geometry files; "" = not said
    bool auto_mask = false;
    std::string saturation = "auto";  ///< auto, none, or the line integral
};

struct StartFlags {
    std::filesystem::path pose;          ///< pose file, "dicom", or "" = none
    std::filesystem::path landmarks3d;   ///< points in the CT; "" = none
    std::vector<std::string> landmarks;  ///< VIEW=FILE, points in the images
};

struct TruthFlags {
    std::filesystem::path targets, truth;  ///< "" = not given
};

struct MethodFlags {
    std::string name = "auto", metric = "gc";
    int levels = 0;  ///< 0 = until images are about 32 px
    int max_iterations = 100;
    std::string content = "auto";
    bool no_robust = false;
    std::uint64_t seed = 1;
};

struct SearchFlags {
    std::string mode = "auto";
    double range_mm = 0, turn_deg = 0;  ///< 0 = the default of the mode
    int starts = 0;                     ///< 0 = the default of the mode
    double time_limit_s = 0;            ///< 0 = none
};

struct OutputFlags {
    std::filesystem::path folder;
    bool quiet = false, json = false;
};

/// In the order in which the help shows them.
void add_volume_flags(CLI::App& command, VolumeFlags& flags);
void add_start_flags(CLI::App& command, StartFlags& flags);
void add_truth_flags(CLI::App& command, TruthFlags& flags);
void add_method_flags(CLI::App& command, MethodFlags& flags);
void add_search_flags(CLI::App& command, SearchFlags& flags);
void add_backend_flags(CLI::App& command, BackendFlags& flags);

/// --views of one or several files, and --undistorted. `what`: what the command takes from them.
void add_views_flag(CLI::App& command, ViewFlags& flags, const std::string& what);
void add_undistorted_flag(CLI::App& command, std::string& undistorted, const char* group);
void add_auto_mask_flag(CLI::App& command, ViewFlags& flags);
void add_saturation_flag(CLI::App& command, ViewFlags& flags);

/// What the command writes, for the help of -o, --json and --quiet.
struct OutputTexts {
    std::string folder, json_file, quiet;
};
void add_output_flags(CLI::App& command, OutputFlags& flags, const OutputTexts& texts);

/// --targets, in `group`. `use`: what for, with its sign before it; "" = as the default says.
void add_targets_flag(CLI::App& command, std::filesystem::path& targets, const char* group, const std::string& use);

/// --seed, a whole number in [0, 2^64): the parser itself would let -1 wrap around.
void add_seed_flag(CLI::App& command, std::uint64_t& seed, const std::string& what, const char* group = kMethodGroup);

}  // namespace raylign::detail::apps
