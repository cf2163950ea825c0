#include <cassert>

#include "core/io/files/json_node.h"
#include "core/io/files/output.h"
#include "raylign/io/views.h"

namespace raylign {
using namespace detail;
using nlohmann::json;
namespace {

json view_json(const View& view) {
    const Camera& camera = view.geometry.camera;
    json result = {{"name", view.name},
                   {"size_px", {camera.size_px.x(), camera.size_px.y()}},
                   {"intrinsics", rows_of(camera.intrinsics_px)},
                   {"camera_from_world", rows_of(to_matrix(view.geometry.camera_from_world))}};
    if (camera.sdd_mm) result["sdd_mm"] = *camera.sdd_mm;
    return result;
}

json intensity_json(const IntensitySettings& intensity) {
    json result = {{"kind", "auto"}};
    if (intensity.kind == IntensityKind::line_integral) result["kind"] = "line-integral";
    if (intensity.kind == IntensityKind::transmission) result["kind"] = "transmission";
    if (intensity.polarity == Polarity::bone_dark) result["polarity"] = "bone-dark";
    if (intensity.polarity == Polarity::bone_bright) result["polarity"] = "bone-bright";
    if (intensity.i0) result["i0"] = *intensity.i0;
    return result;
}

}  // namespace

void write_views(const std::filesystem::path& path, const std::vector<View>& views,
                 const std::vector<std::string>& image_names, const std::vector<ImageFlip>& flips,
                 const std::vector<std::optional<Distortion>>& distortions) {
    assert(image_names.empty() || image_names.size() == views.size());
    assert(flips.empty() || flips.size() == views.size());
    assert(distortions.empty() || distortions.size() == views.size());
    json list = json::array();
    for (std::size_t i = 0; i < views.size(); ++i) {
        json view = view_json(views[i]);
        if (!flips.empty() && flips[i] != ImageFlip::none) {
            view["flip"] = flips[i] == ImageFlip::columns ? "columns" : "rows";
        }
        if (!distortions.empty() && distortions[i]) {
            const Distortion& d = *distortions[i];
            view["distortion"] = {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6};
        }
        if (!image_names.empty()) {
            view["image"] = image_names[i];
            view["intensity"] = {{"kind", "line-integral"}};
        }
        list.push_back(view);
    }
    write_text(path, detail::json_text({{"raylign", 1}, {"views", list}}));
}

void write_views(const std::filesystem::path& path, const std::vector<View>& views,
                 const std::vector<std::string>& image_names, const IntensitySettings& intensity) {
    assert(image_names.size() == views.size());
    json list = json::array();
    for (std::size_t i = 0; i < views.size(); ++i) {
        json view = view_json(views[i]);
        view["image"] = image_names[i];
        view["intensity"] = intensity_json(intensity);
        if (intensity.auto_mask) view["mask"] = "auto";
        list.push_back(view);
    }
    write_text(path, detail::json_text({{"raylign", 1}, {"views", list}}));
}

}  // namespace raylign
