#include "core/io/views/view_files.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/geometry/distortion.h"
#include "core/io/geometry/stored_projection.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

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
                const std::filesystem::path& path, const std::string& where) {
    if (image.empty() || (image.width == camera_px.x() && image.height == camera_px.y())) return;
    throw bad_value(std::string("size of the ") + what + " " + path.string(), size_text(image.width, image.height),
                    "the camera's size_px, " + size_text(camera_px.x(), camera_px.y()), where);
}

}  // namespace

bool is_view_name(const std::string& name) {
    constexpr std::size_t kLongest = 64;
    const auto is_plain = [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-' ||
               c == '.';
    };
    return !name.empty() && name.size() <= kLongest && name.front() != '.' && std::ranges::all_of(name, is_plain);
}

bool is_name_taken(const std::string& name, const ViewsFile& result) {
    return std::ranges::any_of(result.views,
                               [&](const View& view) { return lower_case(view.name) == lower_case(name); });
}

ViewPixels read_view_pixels(const ViewFiles& files, ReadImages images, const std::string& where, ViewsFile& result) {
    ViewPixels pixels;
    if (images == ReadImages::required && files.image.empty()) {
        throw Error(where + " has no image: an X-ray is needed here");
    }
    if (images == ReadImages::never) return pixels;
    const auto list = [&](const std::filesystem::path& path) {
        const bool is_listed = std::ranges::find(result.files, path) != result.files.end();
        if (!is_listed) result.files.push_back(path);  // a DICOM file is geometry and image in one
    };
    if (!files.image.empty() && images != ReadImages::frames) {
        pixels.xray = read_xray(files.image, files.frame);
        list(files.image);
    }
    if (!files.mask.empty()) {
        pixels.mask = read_mask(files.mask);
        list(files.mask);
    }
    return pixels;
}

Eigen::Vector2i frame_size_px(const std::vector<FrameFile>& frames) {
    constexpr std::size_t kMostTried = 100;
    std::string first_fault;
    for (std::size_t i = 0; i < std::min(frames.size(), kMostTried); ++i) {
        if (i > 0 && frames[i].file == frames[i - 1].file) continue;
        try {
            return xray_size_px(frames[i].file);
        } catch (const Error& error) {
            if (i == 0) first_fault = error.what();
        }
    }
    throw Error(first_fault);
}

void append_view(const std::string& name, const GeometryView& geometry, ViewPixels pixels, const ViewFiles& files,
                 const std::string& where, ViewsFile& result) {
    if (is_name_taken(name, result)) {
        throw bad_value("name", "\"" + name + "\"", "different from the other views' names", where);
    }
    const Eigen::Vector2i size_px = geometry.geometry.camera.size_px;
    check_size("image", pixels.xray.image, size_px, files.image, where);
    check_size("mask", pixels.mask, size_px, files.mask, where);
    for (Image* image : {&pixels.xray.image, &pixels.xray.shutter, &pixels.xray.valid, &pixels.mask})
        flip_image(*image, geometry.flip);
    if (geometry.distortion && !(pixels.xray.image.empty() && pixels.mask.empty())) {
        const PixelMap map = undistortion_map(geometry.geometry.camera, *geometry.distortion);
        undistort(pixels.xray, map);
        pixels.mask = undistorted_mask(pixels.mask, map);
    }
    View view;
    view.name = name;
    view.geometry = geometry.geometry;
    view.weights = std::move(pixels.mask);
    if (!pixels.xray.image.empty()) {
        XrayConversion converted =
            line_integral_from_xray(pixels.xray, view.weights, files.intensity, files.image.string());
        view.image = std::move(converted.line_integral);
        view.weights = std::move(converted.weights);
        for (const std::string& decision : converted.decisions) result.notes.push_back(name + ": " + decision);
    }
    for (const std::string& doubt : geometry_doubts(view.geometry)) result.notes.push_back(name + ": " + doubt);
    result.views.push_back(std::move(view));
    result.origins.push_back({geometry.flip, geometry.distortion, geometry.is_dicom, geometry.isocentre_ct_mm,
                              files.image, files.mask, files.intensity, files.frames});
}

}  // namespace raylign::detail
