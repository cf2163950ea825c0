#include "apps/viewer/viewer_page.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/report_page/page_text.h"
#include "apps/shared/json_text.h"
#include "apps/viewer/embedded.h"
#include "apps/viewer/packed.h"
#include "apps/viewer/viewer_files.h"
#include "core/base/error.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

constexpr double kMost16Bit = 65535;

Json volume_json(const std::string& name, const EmbeddedVolume& volume) {
    return {{"name", name},
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

bool is_usable(const View& view, std::size_t pixel) {
    return std::isfinite(view.image.pixels[pixel]) && (view.weights.empty() || view.weights.pixels[pixel] > 0);
}

/// 16 bit, little endian, between the least and the largest usable pixel.
Json image_json(const View& view) {
    if (view.image.empty()) return nullptr;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < view.image.pixels.size(); ++i) {
        if (!is_usable(view, i)) continue;
        low = std::min<double>(low, view.image.pixels[i]);
        high = std::max<double>(high, view.image.pixels[i]);
    }
    if (!(low <= high)) throw Error("view " + view.name + ": no pixel of the X-ray is usable");
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < view.image.pixels.size(); ++i) {
        const double share = high > low && is_usable(view, i) ? (view.image.pixels[i] - low) / (high - low) : 0;
        const auto level = static_cast<unsigned>(std::lround(share * kMost16Bit));
        bytes.push_back(static_cast<std::uint8_t>(level & 255));
        bytes.push_back(static_cast<std::uint8_t>(level >> 8));
    }
    return {{"low", low}, {"high", high}, {"data", packed(bytes)}};
}

Json weights_json(const View& view) {
    if (view.weights.empty() || view.image.empty()) return nullptr;
    std::vector<std::uint8_t> bytes;
    for (const float weight : view.weights.pixels) {
        bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(weight, 0.F, 1.F))));
    }
    return packed(bytes);
}

Json view_json(const View& original) {
    const auto [view, halvings] = embedded(original);
    const Camera& camera = view.geometry.camera;
    return {{"name", view.name},
            {"size_px", vector_json(camera.size_px)},
            {"intrinsics_px", matrix_json(camera.intrinsics_px)},
            {"camera_from_world", matrix_json(view.geometry.camera_from_world)},
            {"sdd_mm", or_null(camera.sdd_mm)},
            {"halvings", halvings},
            {"image", image_json(view)},
            {"weights", weights_json(view)}};
}

Json notes_json(const ViewerScene& scene, const EmbeddedVolume& volume) {
    Json notes = scene.notes;
    if (volume.clipped_share > 0) {
        notes.push_back("Voxels of more than " + one_line(volume.white_per_mm) +
                        " per mm (metal?) are as bright as that in this page, not in the program.");
    }
    return notes;
}

}  // namespace

bool has_viewer() { return !viewer_script().empty(); }

std::string viewer_page(const ViewerScene& scene) {
    if (!has_viewer()) {
        throw Error(
            "this build has no page to place objects in: npm, which bundles it, was not there when it was built",
            ErrorKind::unavailable);
    }
    const EmbeddedVolume volume = embedded(scene.volume);
    Json views = Json::array();
    for (const View& view : scene.views) views.push_back(view_json(view));
    const Json data = {{"version", version()},
                       {"volume", volume_json(scene.name, volume)},
                       {"views", std::move(views)},
                       {"start", matrix_json(scene.start_world_from_ct)},
                       {"command", scene.command},
                       {"folder", scene.folder.string()},
                       {"notes", notes_json(scene, volume)}};
    return filled(std::string(viewer_html()), {{"@TITLE@", "raylign place"},
                                               {"@STYLE@", viewer_style()},
                                               {"@SCRIPT@", viewer_script()},
                                               {"@DATA@", safe_in_script(one_line(data))}});
}

}  // namespace raylign::detail::apps
