#include "apps/viewer/viewer_page.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/report_page/page_text.h"
#include "apps/viewer/packed.h"
#include "apps/viewer/viewer_files.h"
#include "core/base/error.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// Of all objects together: three of the largest volumes, a few MB packed.
constexpr std::size_t kMostVoxels = std::size_t{3} * kLargestVolumeSide * kLargestVolumeSide * kLargestVolumeSide;

Json object_json(const ViewerObject& object, const EmbeddedVolume& volume) {
    return {{"name", object.name},
            {"moves", object.moves},
            {"size", vector_json(volume.grid.size)},
            {"spacing_mm", vector_json(volume.grid.spacing_mm)},
            {"origin_mm", vector_json(volume.grid.origin_mm)},
            {"direction", matrix_json(volume.grid.direction)},
            {"per_mm", volume.white_per_mm},
            {"halvings", volume.halvings},
            {"centre_ct_mm", vector_json(volume.centre_ct_mm)},
            {"radius_mm", volume.radius_mm},
            {"data", packed(volume.values)}};
}

/// Many objects share what a page can carry: all are halved further until they fit.
std::vector<EmbeddedVolume> embedded_objects(const std::vector<ViewerObject>& objects) {
    std::vector<EmbeddedVolume> volumes;
    for (int side = kLargestVolumeSide; volumes.empty(); side = side * 4 / 5) {
        std::size_t voxels = 0;
        for (const ViewerObject& object : objects) {
            volumes.push_back(embedded(object.volume, side));
            voxels += volumes.back().values.size();
        }
        if (voxels > kMostVoxels) volumes.clear();
    }
    return volumes;
}

bool is_usable(const View& view, std::size_t pixel) {
    return std::isfinite(view.image.pixels[pixel]) && (view.weights.empty() || view.weights.pixels[pixel] > 0);
}

Json weights_json(const View& view) {
    if (view.weights.empty()) return nullptr;
    std::vector<std::uint8_t> bytes;
    for (const float weight : view.weights.pixels) {
        bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(weight, 0.F, 1.F))));
    }
    return packed(bytes);
}

/// Little endian, between the least and the largest usable pixel.
Json xray_json(const View& view, XrayDepth depth) {
    if (view.image.empty()) return nullptr;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < view.image.pixels.size(); ++i) {
        if (!is_usable(view, i)) continue;
        low = std::min<double>(low, view.image.pixels[i]);
        high = std::max<double>(high, view.image.pixels[i]);
    }
    if (!(low <= high)) throw Error("view " + view.name + ": no pixel of the X-ray is usable");
    const double most = depth == XrayDepth::bits_8 ? 255 : 65535;
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < view.image.pixels.size(); ++i) {
        const double share = high > low && is_usable(view, i) ? (view.image.pixels[i] - low) / (high - low) : 0;
        const auto level = static_cast<unsigned>(std::lround(share * most));
        bytes.push_back(static_cast<std::uint8_t>(level & 255));
        if (depth == XrayDepth::bits_16) bytes.push_back(static_cast<std::uint8_t>(level >> 8));
    }
    return {{"low", low},
            {"high", high},
            {"bytes", static_cast<int>(depth)},
            {"data", packed(bytes)},
            {"weights", weights_json(view)}};
}

std::string flip_name(ImageFlip flip) {
    return flip == ImageFlip::none ? "none" : flip == ImageFlip::columns ? "columns" : "rows";
}

/// How the pixels of the file lie.
Json stored_json(const View& view, const ViewOrigin& origin) {
    Json distortion = nullptr;
    if (const auto& d = origin.distortion) distortion = {d->k1, d->k2, d->p1, d->p2, d->k3, d->k4, d->k5, d->k6};
    return {{"size_px", vector_json(view.geometry.camera.size_px)},
            {"flip", flip_name(origin.flip)},
            {"distortion", std::move(distortion)}};
}

Json view_json(const View& original, const ViewOrigin& origin, int longest_side_px) {
    View geometry = original;
    geometry.image = geometry.weights = {};
    const auto [view, halvings] = embedded(geometry, longest_side_px);
    const Camera& camera = view.geometry.camera;
    return {{"name", view.name},
            {"size_px", vector_json(camera.size_px)},
            {"intrinsics_px", matrix_json(camera.intrinsics_px)},
            {"camera_from_world", matrix_json(view.geometry.camera_from_world)},
            {"sdd_mm", or_null(camera.sdd_mm)},
            {"halvings", halvings},
            {"stored", stored_json(original, origin)}};
}

Json frame_json(const ViewerFrame& frame) {
    Json poses = Json::array();
    for (const RigidTransform& pose : frame.world_from_ct) poses.push_back(matrix_json(pose));
    return {{"number", frame.number}, {"xrays", frame.xrays}, {"poses", poses}, {"status", frame.status}};
}

Json go_on_json(const GoOn& go_on) {
    Json keys = Json::array();
    for (const GoOn::KeyFrame& key : go_on.key_frames) {
        keys.push_back({{"object", key.object}, {"frame", key.frame}, {"words", key.words}});
    }
    return {{"begin", go_on.begin}, {"end", go_on.end}, {"key_frames", std::move(keys)}};
}

}  // namespace

bool has_viewer() { return !viewer_script().empty(); }

void refuse_without_viewer() {
    if (has_viewer()) return;
    throw Error("this build has no page to place objects in: npm, which bundles it, was not there when it was built",
                ErrorKind::unavailable);
}

std::vector<Json> viewer_xrays(std::span<const View> views, XrayDepth depth, int longest_side_px) {
    std::vector<Json> xrays;
    for (const View& view : views) xrays.push_back(xray_json(embedded(view, longest_side_px).view, depth));
    return xrays;
}

Json viewer_json(const ViewerScene& scene) {
    const std::vector<EmbeddedVolume> volumes = embedded_objects(scene.objects);
    Json objects = Json::array(), views = Json::array(), frames = Json::array(), notes = scene.notes;
    for (std::size_t k = 0; k < volumes.size(); ++k) {
        objects.push_back(object_json(scene.objects[k], volumes[k]));
        if (volumes[k].clipped_share == 0) continue;
        notes.push_back("Voxels of more than " + one_line(volumes[k].white_per_mm) +
                        " per mm (metal?) are as bright as that in this page, not in the program.");
    }
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
        views.push_back(view_json(scene.views[v], scene.origins[v], scene.longest_side_px));
    }
    for (const ViewerFrame& frame : scene.frames) frames.push_back(frame_json(frame));
    return {{"version", version()},
            {"title", scene.title},
            {"is_sequence", scene.is_sequence},
            {"objects", std::move(objects)},
            {"views", std::move(views)},
            {"frames", std::move(frames)},
            {"go_on", go_on_json(scene.go_on)},
            {"folder", scene.folder.string()},
            {"notes", std::move(notes)}};
}

PageScript viewer_script_of(const ViewerScene& scene) {
    if (!has_viewer()) return {};
    const Json style = std::string(viewer_style());
    return {viewer_script(), {{"viewer", one_line(viewer_json(scene))}, {"viewer_style", one_line(style)}}};
}

std::string viewer_page(const ViewerScene& scene) {
    refuse_without_viewer();
    return framed({.title = "raylign place",
                   .style = viewer_style(),
                   .main = "viewer",
                   .data = one_line(viewer_json(scene)),
                   .libraries = {},
                   .script = viewer_script()});
}

}  // namespace raylign::detail::apps
