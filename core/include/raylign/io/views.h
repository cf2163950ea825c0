#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "raylign/intensity.h"
#include "raylign/io/frame_files.h"
#include "raylign/io/geometry.h"
#include "raylign/view.h"

namespace raylign {

/// Which pixels are read.
enum class ReadImages {
    required,  ///< register, compare: a view without an image is an error
    if_named,  ///< study: read what is there
    never,     ///< drr: geometry only
    frames,    ///< track: masks now, and a list of frames for each view
};

/// Where a view comes from, as far as the pixels and the world depend on it.
struct ViewOrigin {
    ImageFlip flip = ImageFlip::none;      ///< done to the stored pixels: points marked on them need it, too
    std::optional<Distortion> distortion;  ///< undone after `flip`: points marked on the pixels need that, too
    bool is_dicom_geometry = false;        ///< the world is the isocentre with the patient's axes
    std::optional<Eigen::Vector3d> isocentre_ct_mm;
    std::filesystem::path image, mask;  ///< the files named, whether read or not; "" = none
    IntensitySettings intensity;        ///< how its pixels become line integrals
    /// With ReadImages::frames: by number, at least one. Numbers are the first view's: those of a view that says which
    /// of its own belongs to the sequence's first ("frames": {"first": N}) are shifted.
    std::vector<FrameFile> frames;
};

/// The X-rays of a study, as register_volume takes them, and what the files said besides.
struct ViewsFile {
    std::vector<View> views;
    std::vector<ViewOrigin> origins;  ///< one per view
    std::vector<std::string> notes;   ///< decisions of the intensity conversion and assumptions of the geometry
    std::vector<std::filesystem::path> files;  ///< the JSON, images and masks read
};

/// How views are read.
struct ViewsReadOptions {
    ReadImages images = ReadImages::required;
    bool auto_mask = false;  ///< for every view, as "mask": "auto" says it for one
    /// With ReadImages::frames: VIEW=PATTERN (list_frames), before what the files name.
    std::vector<std::string> frames;
    /// GeometryHints::undistorted for geometry files and trials among the arguments; views.json says it for itself.
    std::optional<bool> undistorted;
};

/// Reads views.json (docs/formats.md describes it): all five forms of geometry. Unknown keys, wrong types and malformed
/// JSON are errors that name the file, the line or the key's path ("views[1].camera.sdd_mm").
[[nodiscard]] ViewsFile read_views(const std::filesystem::path& path, ReadImages images);

/// Reads views.json files and geometry files of other tools (raylign/io/geometry.h), each as FILE or FILE=IMAGE; a
/// DICOM X-ray is its own image. Views of geometry files are called like the file. Throws Error where two views have
/// one name.
[[nodiscard]] ViewsFile read_views(std::span<const std::string> arguments, const ViewsReadOptions& options);

/// The same without automatic masks.
[[nodiscard]] inline ViewsFile read_views(const std::vector<std::string>& arguments, ReadImages images) {
    ViewsReadOptions options;
    options.images = images;
    return read_views(arguments, options);
}

/// Writes views.json with `projection`-exact cameras ("intrinsics" + "camera_from_world", sdd where known).
/// `image_names`: one per view, or empty for none; kind is written as "line-integral". `flips`, `distortions`: how
/// images of these views will be stored, one per view, or empty for none.
void write_views(const std::filesystem::path& path, const std::vector<View>& views,
                 const std::vector<std::string>& image_names, const std::vector<ImageFlip>& flips = {},
                 const std::vector<std::optional<Distortion>>& distortions = {});

/// The same with images that are to be read as `intensity` says (a detector's counts).
void write_views(const std::filesystem::path& path, const std::vector<View>& views,
                 const std::vector<std::string>& image_names, const IntensitySettings& intensity);

}  // namespace raylign
