#include "raylign/io/views.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"
#include "core/io/poses/autoscoper_trial.h"
#include "core/io/views/view_files.h"
#include "core/io/views/views_geometry.h"

namespace raylign {
using namespace detail;
namespace {

using detail::JsonNode;
using detail::ViewFiles;

IntensitySettings read_intensity(const JsonNode& view) {
    IntensitySettings settings;
    if (!view.has("intensity")) return settings;
    const JsonNode node = view.at("intensity");
    node.allow_keys({"kind", "i0", "polarity"});
    if (node.has("kind")) {
        settings.kind = static_cast<IntensityKind>(node.at("kind").one_of({"auto", "line-integral", "transmission"}));
    }
    if (node.has("polarity")) {
        settings.polarity = static_cast<Polarity>(node.at("polarity").one_of({"auto", "bone-bright", "bone-dark"}));
    }
    if (node.has("i0")) settings.i0 = node.at("i0").positive();
    return settings;
}

/// The name becomes part of file names (overlay_<view>.png).
std::string read_name(const JsonNode& view) {
    const JsonNode node = view.at("name");
    const std::string name = node.string();
    if (!detail::is_view_name(name)) {
        throw node.error(
            "1 to 64 letters, digits, '_', '-' or '.', not beginning with '.' (it becomes part of file names)");
    }
    return name;
}

std::filesystem::path read_path(const JsonNode& node, const std::filesystem::path& folder) {
    const std::string name = node.string();
    if (name.empty()) throw node.error("a file name");
    return folder / name;  // an absolute name stays as it is
}

/// The pattern that `options` give for a view; none where they do not name it.
std::optional<std::string> frames_option(const std::string& view, const ViewsReadOptions& options) {
    for (const std::string& argument : options.frames) {
        const auto both = name_and_value(argument);
        if (both && both->first == view) return both->second;
    }
    return std::nullopt;
}

/// The frames of a view: by the options, its key "frames" (a pattern or a list of files), or its image.
std::vector<FrameFile> read_frames(const JsonNode& view, const std::string& name, const std::filesystem::path& folder,
                                   const std::filesystem::path& image, const ViewsReadOptions& options) {
    if (const auto pattern = frames_option(name, options)) return list_frames(*pattern);
    const bool is_object = view.has("frames") && view.at("frames").has("first");
    if (!view.has("frames") || (is_object && !view.at("frames").has("files"))) {
        return image.empty() ? std::vector<FrameFile>() : list_frames(image);
    }
    const JsonNode node = is_object ? view.at("frames").at("files") : view.at("frames");
    if (node.is_text()) return list_frames(read_path(node, folder));
    std::vector<std::filesystem::path> files;
    for (std::size_t i = 0; i < node.array_size(); ++i) files.push_back(read_path(node.at(i), folder));
    return list_frames(files);
}

/// "frames": {"first": N, "files": ...}: which of its numbers belongs to the first frame of the sequence.
std::optional<int> first_frame(const JsonNode& view) {
    if (!view.has("frames") || !view.at("frames").has("first")) return std::nullopt;
    view.at("frames").allow_keys({"first", "files"});
    const JsonNode node = view.at("frames").at("first");
    const double number = node.number();
    if (number != std::round(number) || !(std::abs(number) < 1e9)) throw node.error("a whole number below 1e9");
    return static_cast<int>(number);
}

/// Brings the numbers of views that count from elsewhere to those of the first view.
void shift_frames(std::span<const std::optional<int>> firsts, ViewsFile& result) {
    std::optional<int> base;
    if (!result.origins.empty() && !result.origins.front().frames.empty()) {
        base = result.origins.front().frames.front().number;
    }
    if (!firsts.empty() && firsts.front()) base = firsts.front();
    for (std::size_t v = 0; base && v < firsts.size(); ++v) {
        if (!firsts[v]) continue;
        for (FrameFile& frame : result.origins[v].frames) frame.number += *base - *firsts[v];
    }
}

/// Throws Error for a VIEW=PATTERN that is none, names no view, or one twice; and where a view has no frames.
void check_frames(const ViewsReadOptions& options, const ViewsFile& result) {
    std::vector<std::string> named;
    for (const std::string& argument : options.frames) {
        const auto both = name_and_value(argument);
        if (!both) throw bad_value("--frames", argument, "VIEW=PATTERN");
        const std::string& name = both->first;
        if (std::ranges::find(result.views, name, &View::name) == result.views.end()) {
            throw bad_value("view of --frames", name, "one of " + joined(result.views, &View::name, ", "));
        }
        if (std::ranges::find(named, name) != named.end()) throw Error("--frames names the view " + name + " twice");
        named.push_back(name);
    }
    for (std::size_t v = 0; options.images == ReadImages::frames && v < result.views.size(); ++v) {
        if (!result.origins[v].frames.empty()) continue;
        throw Error("view " + result.views[v].name +
                    " has no frames: name them in views.json (\"frames\"), as FILE=PATTERN, or by --frames " +
                    result.views[v].name + "=PATTERN");
    }
}

bool is_dicom(const std::filesystem::path& path) { return geometry_format_of(path) == GeometryFormat::dicom; }

/// A DICOM file that gives the geometry is the image, too, unless another one is named.
ViewFiles read_files(const JsonNode& view, const std::filesystem::path& folder) {
    ViewFiles files;
    files.intensity = read_intensity(view);
    if (view.has("image")) files.image = read_path(view.at("image"), folder);
    const bool is_auto = view.has("mask") && view.at("mask").string() == "auto";
    files.intensity.auto_mask = is_auto;
    if (view.has("mask") && !is_auto) files.mask = read_path(view.at("mask"), folder);
    if (view.has("frame")) files.frame = detail::read_count(view.at("frame"));
    if (!detail::has_geometry_file(view)) return files;
    const std::filesystem::path geometry = read_path(view.at("geometry"), folder);
    if (files.image.empty() && is_dicom(geometry)) {
        files.image = geometry;
        files.frame = std::max(1, files.frame);
    }
    return files;
}

void allow_view_keys(const JsonNode& node) {
    node.allow_keys({"name",
                     "image",
                     "mask",
                     "intensity",
                     "camera",
                     "size_px",
                     "intrinsics",
                     "sdd_mm",
                     "camera_from_world",
                     "distortion",
                     "projection_matrix",
                     "c_arm",
                     "geometry",
                     "pixel_pitch_mm",
                     "detector_origin_mm",
                     "sad_mm",
                     "unit_mm",
                     "undistorted",
                     "flip",
                     "frame",
                     "frames",
                     "primary_angle_deg",
                     "secondary_angle_deg",
                     "projection"});
}

void read_view(const JsonNode& node, const std::filesystem::path& folder, const ViewsReadOptions& options,
               ViewsFile& result) {
    allow_view_keys(node);
    const std::string name = read_name(node);
    if (detail::is_name_taken(name, result)) throw node.at("name").error("different from the other views' names");
    ViewFiles files = read_files(node, folder);
    files.intensity.auto_mask = files.intensity.auto_mask || options.auto_mask;
    const std::string where = node.where();
    if (options.images == ReadImages::required && files.image.empty()) {
        throw Error(node.place() + ".image is missing in " + node.file() + ": an X-ray is needed here");
    }
    if (options.images == ReadImages::frames) {
        files.frames = read_frames(node, name, folder, files.image, options);
    }
    detail::ViewPixels pixels = detail::read_view_pixels(files, options.images, where, result);
    std::optional<Eigen::Vector2i> image_size_px;
    if (!files.frames.empty()) image_size_px = detail::frame_size_px(files.frames);
    if (!pixels.xray.image.empty()) {
        image_size_px = Eigen::Vector2i(pixels.xray.image.width, pixels.xray.image.height);
    }
    const GeometryView geometry = detail::read_view_geometry(node, folder, image_size_px, result.notes);
    if (detail::has_geometry_file(node)) {
        const std::filesystem::path path = folder / node.at("geometry").string();
        if (std::ranges::find(result.files, path) == result.files.end()) result.files.push_back(path);
    }
    detail::append_view(name, geometry, std::move(pixels), files, where, result);
}

void append_views_json(const std::filesystem::path& path, const ViewsReadOptions& options, ViewsFile& result) {
    const nlohmann::json json = detail::read_json(path);
    const JsonNode root(json, "the file", path.string());
    root.allow_keys({"raylign", "views"});
    detail::check_format_version(root);
    const JsonNode views = root.at("views");
    if (views.array_size() == 0) throw views.error("at least one view");
    result.files.push_back(path);
    std::vector<std::optional<int>> firsts(result.views.size());  // of views read before: as they are
    for (std::size_t i = 0; i < views.array_size(); ++i) {
        read_view(views.at(i), path.parent_path(), options, result);
        firsts.push_back(first_frame(views.at(i)));
    }
    shift_frames(firsts, result);
}

/// A file's stem with every other character turned into '_'.
std::string view_name_of(const std::string& stem) {
    std::string name = stem.substr(0, 64);
    for (char& c : name) {
        if (!detail::is_view_name(std::string("x") + c)) c = '_';
    }
    if (name.empty() || name.front() == '.') name = "view" + name.substr(0, 60);
    return name;
}

/// FILE or FILE=IMAGE; an "=" within the name of a file that exists belongs to the name.
std::pair<std::filesystem::path, std::filesystem::path> split_argument(const std::string& argument) {
    const std::size_t equals = argument.find('=');
    std::error_code ignored;
    if (equals == std::string::npos || std::filesystem::exists(argument, ignored)) return {argument, {}};
    return {argument.substr(0, equals), argument.substr(equals + 1)};
}

void append_trial(const std::filesystem::path& path, const std::filesystem::path& image,
                  const ViewsReadOptions& options, ViewsFile& result);

void append_geometry_file(const std::filesystem::path& path, const std::filesystem::path& image,
                          const ViewsReadOptions& options, ViewsFile& result) {
    if (detail::is_autoscoper_trial(path)) {
        append_trial(path, image, options, result);
        return;
    }
    ViewFiles files;
    files.intensity.auto_mask = options.auto_mask;
    files.image = image;
    if (image.empty() && is_dicom(path)) {
        files.image = path;
        files.frame = 1;
    }
    if (options.images == ReadImages::frames) {
        const auto pattern = frames_option(view_name_of(path.stem().string()), options);
        if (pattern) files.image = *pattern;
        if (!files.image.empty()) files.frames = list_frames(files.image);
    }
    result.files.push_back(path);
    detail::ViewPixels pixels = detail::read_view_pixels(files, options.images, path.string(), result);
    GeometryHints hints;
    hints.undistorted = options.undistorted;
    if (!files.frames.empty()) hints.size_px = detail::frame_size_px(files.frames);
    if (!pixels.xray.image.empty()) {
        hints.size_px = Eigen::Vector2i(pixels.xray.image.width, pixels.xray.image.height);
    }
    const std::vector<GeometryView> views = read_geometry(path, hints);
    if (views.size() > 1 && !files.image.empty()) {
        throw Error(path.string() + " has " + std::to_string(views.size()) +
                    " projections: name one per view in a views.json (\"geometry\", \"projection\", \"image\")");
    }
    for (const GeometryView& view : views) {
        const std::string name = view_name_of(view.name);
        for (const std::string& assumption : view.assumptions) result.notes.push_back(name + ": " + assumption);
        detail::append_view(name, view, pixels, files, path.string(), result);
    }
}

/// The image of a camera at one instant: the only one of its folder.
std::string only_image(const detail::TrialCamera& camera, const std::filesystem::path& trial) {
    const std::vector<FrameFile> frames = list_frames(camera.frames);
    if (frames.size() == 1) return frames.front().file.string();
    throw Error(trial.string() + ": " + camera.frames.string() + " has " + std::to_string(frames.size()) +
                " images, and one instant is needed here: name one image for each camera, as --views " +
                camera.mayacam.string() + "=IMAGE");
}

/// Each camera with its sequence, as if they were named on the command line.
void append_trial(const std::filesystem::path& path, const std::filesystem::path& image,
                  const ViewsReadOptions& options, ViewsFile& result) {
    if (!image.empty()) {
        throw bad_value("views", path.string() + "=" + image.string(),
                        "a trial without \"=IMAGE\": it names its cameras' folders itself");
    }
    result.files.push_back(path);
    for (const detail::TrialCamera& camera : detail::read_autoscoper_trial(path).cameras) {
        std::filesystem::path images;
        if (options.images == ReadImages::frames) images = camera.frames;
        if (options.images == ReadImages::required) images = only_image(camera, path);
        append_geometry_file(camera.mayacam, images, options, result);
    }
}

}  // namespace

ViewsFile read_views(const std::filesystem::path& path, ReadImages images) {
    ViewsFile result;
    append_views_json(path, {.images = images}, result);
    return result;
}

ViewsFile read_views(std::span<const std::string> arguments, const ViewsReadOptions& options) {
    if (arguments.empty()) throw Error("no views: must name at least one file");
    ViewsFile result;
    for (const std::string& argument : arguments) {
        const auto [path, image] = split_argument(argument);
        const bool is_json = detail::lower_case(path.extension().string()) == ".json";
        if (is_json && !image.empty()) {
            throw bad_value("views", argument, "a views.json without \"=IMAGE\": it names its images itself");
        }
        if (is_json && options.undistorted) {
            throw Error("--undistorted is for geometry files and trials: " + path.string() +
                        " says it itself, beside \"geometry\"");
        }
        if (is_json) {
            append_views_json(path, options, result);
        } else {
            append_geometry_file(path, image, options, result);
        }
    }
    check_frames(options, result);
    return result;
}

}  // namespace raylign
