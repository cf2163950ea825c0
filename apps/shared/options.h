#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"

namespace raylign::detail::apps {

/// What every sub-command gets besides its own options.
struct Invocation {
    std::string command_line;  ///< quoted for a shell: repeats the run
};

struct VolumeFlags {
    std::filesystem::path file;
    std::string hu_preset;  ///< "" = the default preset
    double hu_offset = 0;   ///< added to the stored values
    bool attenuation = false;
    std::string series;
    std::string spacing;                         ///< "X,Y,Z" [mm]; "" = from the file
    std::filesystem::path labels;                ///< label map; "" = none
    std::vector<int> label;                      ///< of the map, to keep; none = all but 0
    std::string object;                          ///< "X0,Y0,Z0,X1,Y1,Z1" [ct mm], or voxels:...; "" = the whole CT
    std::optional<double> bone_threshold, clip;  ///< HU (1/mm with attenuation)
};

struct EngineFlags {
    std::string backend = "auto";
    std::string device;
    int threads = 0;                          ///< 0 = all cores
    std::string storage;                      ///< float32 or int16; "" = the engine's own choice
    std::string interpolation;                ///< gl: hardware or exact; "" = hardware
    bool crop = false;                        ///< gl: keep only the box around the object
    std::string slices, reduction, readback;  ///< gl-2006: baselines of the paper; "" = its own way
    std::string projector = "joseph";
    double step_mm = 0;  ///< 0 = half the smallest voxel side
};

struct RegisterOptions {
    VolumeFlags volume;
    EngineFlags engine;
    std::vector<std::string> views;  ///< views.json or geometry files, each FILE or FILE=IMAGE
    bool auto_mask = false;
    std::filesystem::path output;
    std::filesystem::path start, targets, truth;  ///< "" = not given; start may be the word dicom
    std::filesystem::path landmarks3d;            ///< points in the CT; "" = none
    std::vector<std::string> landmarks;           ///< VIEW=FILE, points in the images
    std::string method = "auto";
    std::string metric = "gc";
    int levels = 0;  ///< 0 = until images are about 32 px
    int max_iterations = 100;
    std::string content = "auto", search = "auto";
    double search_range_mm = 0, search_turn_deg = 0;  ///< 0 = the default of the mode
    int search_starts = 0;                            ///< 0 = the default of the mode
    double time_limit_s = 0;                          ///< 0 = none
    bool no_robust = false;
    std::uint64_t seed = 1;
    bool quiet = false;
    bool json = false;
};

struct DrrOptions {
    VolumeFlags volume;
    EngineFlags engine;
    std::vector<std::string> views;
    std::filesystem::path pose, output;
    double noise_photons = 0;  ///< 0 = no noise
    std::uint64_t seed = 1;
    bool png = false;
    bool quiet = false;
};

struct PhantomOptions {
    std::string kind;
    std::string size = "128,128,128";
    std::string spacing = "2,2,2";
    std::filesystem::path output;
};

struct GeometryOptions {
    std::vector<std::string> files;
    std::filesystem::path output;   ///< "" = print only
    std::string format;             ///< of the output; "" = by its extension
    std::string size, pixel_pitch;  ///< "W,H" [px], "X,Y" [mm]; "" = from the file
    double sdd_mm = 0;              ///< 0 = from the file
    std::string flip;               ///< "" = the format's own
    bool json = false;
};

struct InfoOptions {
    bool json = false;
};

/// All conflicts between flags are settled here: throws Error for options that contradict each other or would be
/// ignored.
void settle_conflicts(const RegisterOptions& options);
void settle_conflicts(const DrrOptions& options);

/// Flags to the library's own options; unknown names throw Error listing the valid ones.
[[nodiscard]] VolumeReadOptions volume_read_options(const VolumeFlags& flags);
[[nodiscard]] RenderSettings render_settings(const EngineFlags& flags);
[[nodiscard]] RegistrationOptions registration_options(const RegisterOptions& options);

/// The flags for another backend. "gl-2006-mipmap" is gl-2006 with --reduction mipmap, Chisu's baseline in the paper: a
/// name of its own, so that one study can hold both.
[[nodiscard]] EngineFlags with_backend(EngineFlags flags, const std::string& name);

/// The backend that the flags name. Throws Error, kind unavailable, where --device names something the chosen one
/// lacks.
[[nodiscard]] BackendChoice choose_backend(const EngineFlags& flags);

/// `count` numbers with commas between them. `option` is named in the Error for anything else.
[[nodiscard]] std::vector<double> parse_numbers(std::string_view text, std::size_t count, std::string_view option);

/// "4,5,6" or "4" (all three). `option` is named in the Error for anything else.
[[nodiscard]] Eigen::Vector3d parse_triple(std::string_view text, std::string_view option);

/// Throws Error for anything but a whole number in [0, 2^64).
[[nodiscard]] std::uint64_t parse_seed(std::string_view text);

/// The arguments joined by blanks, quoted for a POSIX shell where needed.
[[nodiscard]] std::string quote_for_shell(const std::vector<std::string>& arguments);

/// Throws Error if writing `names` into `folder` would replace one of the `inputs`.
void refuse_to_overwrite(const std::vector<std::filesystem::path>& inputs, const std::filesystem::path& folder,
                         const std::vector<std::string>& names);

}  // namespace raylign::detail::apps
