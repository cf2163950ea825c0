#include "core/io/views_io.h"

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/io/image_io.h"
#include "core/io/json_node.h"
#include "core/io/text.h"
#include "core/io/views_geometry.h"

namespace raylign {
namespace {

using detail::JsonNode;

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
    constexpr std::size_t kLongest = 64;
    const JsonNode node = view.at("name");
    std::string name = node.string();
    const auto is_plain = [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-' ||
               c == '.';
    };
    if (name.empty() || name.size() > kLongest || name.front() == '.' || !std::ranges::all_of(name, is_plain)) {
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

Image read_mask(const std::filesystem::path& path) {
    Image mask = read_xray(path).image;
    for (float& value : mask.pixels) value = value != 0 ? 1.0F : 0.0F;  // NaN != 0: used, like every other mark
    if (std::ranges::count(mask.pixels, 0.0F) == std::ssize(mask.pixels)) {
        throw Error("mask " + path.string() + " is 0 everywhere");
    }
    return mask;
}

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

void check_size(const char* what, const Image& image, const Eigen::Vector2i& camera_px,
                const std::filesystem::path& path, const JsonNode& view) {
    if (image.empty() || (image.width == camera_px.x() && image.height == camera_px.y())) return;
    throw bad_value(std::string("size of the ") + what + " " + path.string(), size_text(image.width, image.height),
                    "the camera's size_px, " + size_text(camera_px.x(), camera_px.y()), view.where());
}

/// The files of one view, as read.
struct ViewFiles {
    std::filesystem::path image_path, mask_path;
    RawXray xray;
    Image mask;
};

ViewFiles read_files(const JsonNode& view, const std::filesystem::path& folder, ReadImages images, ViewsFile& result) {
    ViewFiles files;
    if (view.has("image")) files.image_path = read_path(view.at("image"), folder);
    if (view.has("mask")) files.mask_path = read_path(view.at("mask"), folder);
    if (images == ReadImages::required && files.image_path.empty()) {
        throw Error(view.place() + ".image is missing in " + view.file() + ": an X-ray is needed here");
    }
    if (images == ReadImages::never) return files;
    if (!files.image_path.empty()) {
        files.xray = read_xray(files.image_path);
        result.files.push_back(files.image_path);
    }
    if (!files.mask_path.empty()) {
        files.mask = read_mask(files.mask_path);
        result.files.push_back(files.mask_path);
    }
    return files;
}

View read_view(const JsonNode& node, const std::filesystem::path& folder, ReadImages images, ViewsFile& result) {
    node.allow_keys({"name", "image", "mask", "intensity", "camera", "camera_from_world", "projection_matrix",
                     "size_px", "intrinsics", "sdd_mm", "c_arm"});
    View view;
    view.name = read_name(node);
    const IntensitySettings intensity = read_intensity(node);
    ViewFiles files = read_files(node, folder, images, result);
    std::optional<Eigen::Vector2i> image_size_px;
    if (!files.xray.image.empty()) image_size_px = Eigen::Vector2i(files.xray.image.width, files.xray.image.height);
    view.geometry = detail::read_view_geometry(node, image_size_px, result.notes);
    check_size("image", files.xray.image, view.geometry.camera.size_px, files.image_path, node);
    check_size("mask", files.mask, view.geometry.camera.size_px, files.mask_path, node);
    view.weights = files.mask;
    if (files.xray.image.empty()) return view;
    XrayConversion converted = line_integral_from_xray(files.xray, files.mask, intensity, files.image_path.string());
    view.image = std::move(converted.line_integral);
    view.weights = std::move(converted.weights);
    for (const std::string& decision : converted.decisions) result.notes.push_back(view.name + ": " + decision);
    return view;
}

}  // namespace

ViewsFile read_views(const std::filesystem::path& path, ReadImages images) {
    const nlohmann::json json = detail::read_json(path);
    const JsonNode root(json, "the file", path.string());
    root.allow_keys({"raylign", "views"});
    detail::check_format_version(root);
    const JsonNode views = root.at("views");
    if (views.array_size() == 0) throw views.error("at least one view");
    ViewsFile result;
    result.files.push_back(path);
    std::set<std::string> names;  // in lower case: some file systems do not tell AP from ap
    for (std::size_t i = 0; i < views.array_size(); ++i) {
        result.views.push_back(read_view(views.at(i), path.parent_path(), images, result));
        if (!names.insert(detail::lower_case(result.views.back().name)).second) {
            throw views.at(i).at("name").error("different from the other views' names");
        }
    }
    return result;
}

}  // namespace raylign
