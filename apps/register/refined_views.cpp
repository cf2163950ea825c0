#include "apps/register/refined_views.h"

#include <algorithm>
#include <array>

#include "apps/shared/json_text.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace raylign::detail::apps {
namespace {

/// As the file in `folder` finds it: paths in views.json are relative to it.
std::string path_from(const std::filesystem::path& folder, const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::path there = std::filesystem::weakly_canonical(file, error);
    const std::filesystem::path here = std::filesystem::weakly_canonical(folder, error);
    const std::filesystem::path relative = there.lexically_relative(here);
    return relative.empty() ? there.generic_string() : relative.generic_string();
}

Json intensity_json(const IntensitySettings& settings) {
    constexpr std::array kKinds{"auto", "line-integral", "transmission"};
    constexpr std::array kPolarities{"auto", "bone-bright", "bone-dark"};
    Json intensity = {{"kind", kKinds.at(static_cast<std::size_t>(settings.kind))},
                      {"polarity", kPolarities.at(static_cast<std::size_t>(settings.polarity))}};
    if (settings.i0) intensity["i0"] = *settings.i0;
    return intensity;
}

Json refined_view(const View& view, const ViewOrigin& origin, const std::filesystem::path& folder) {
    const Camera& camera = view.geometry.camera;
    Json json = {{"name", view.name}};
    if (!origin.image.empty()) json["image"] = path_from(folder, origin.image);
    if (origin.intensity.auto_mask) json["mask"] = "auto";
    if (!origin.mask.empty()) json["mask"] = path_from(folder, origin.mask);
    json["intensity"] = intensity_json(origin.intensity);
    json["size_px"] = vector_json(camera.size_px);
    json["intrinsics"] = matrix_json(camera.intrinsics_px);
    json["camera_from_world"] = matrix_json(view.geometry.camera_from_world);
    if (camera.sdd_mm) json["sdd_mm"] = *camera.sdd_mm;
    if (origin.flip != ImageFlip::none) json["flip"] = origin.flip == ImageFlip::columns ? "columns" : "rows";
    if (origin.distortion) {
        const Distortion& d = *origin.distortion;
        json["distortion"] = {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6};
    }
    return json;
}

}  // namespace

bool settle_refinement(const RefineFlags& flags, const MethodFlags& method, const SearchFlags& search) {
    if (!flags.refine_views) {
        if (!flags.prior.empty()) throw Error("--view-prior has no meaning without --refine-views");
        if (!flags.kept_view.empty()) throw Error("--keep-view has no meaning without --refine-views");
        return false;
    }
    if (method.name != "auto" && method.name != "gauss-newton") {
        throw Error("--refine-views solves by gauss-newton: leave --method " + method.name + " out");
    }
    if (search.time_limit_s != 0) {
        throw Error("--refine-views contradicts --time-limit: it registers several times, each to its end");
    }
    return true;
}

ViewPrior view_prior(const RefineFlags& flags, const std::vector<View>& views) {
    if (views.size() < 2) {
        throw Error(
            "--refine-views: one view cannot tell its camera's error from the object's pose: at least two are "
            "needed");
    }
    ViewPrior prior;
    if (!flags.prior.empty()) {
        const std::vector<double> numbers = parse_numbers(flags.prior, 2, "--view-prior");
        prior.rotation_deg = numbers[0];
        prior.translation_mm = numbers[1];
        const bool is_possible = numbers[0] > 0 && numbers[0] <= 30 && numbers[1] > 0 && numbers[1] <= 200;
        if (!is_possible) throw bad_value("--view-prior", flags.prior, "DEG,MM in (0, 30] degrees and (0, 200] mm");
    }
    if (flags.kept_view.empty()) return prior;
    prior.kept_view.reset();
    if (flags.kept_view == "none") return prior;
    const auto found = std::ranges::find(views, flags.kept_view, &View::name);
    if (found == views.end()) {
        std::vector<std::string> names;
        for (const View& view : views) names.push_back(view.name);
        throw bad_value("--keep-view", flags.kept_view, joined(names, ", ") + " or none");
    }
    prior.kept_view = static_cast<std::size_t>(found - views.begin());
    return prior;
}

std::vector<View> views_of(const RegistrationResult& result, const std::vector<View>& views) {
    std::vector<View> moved = views;
    for (std::size_t v = 0; v < moved.size(); ++v) {
        moved[v].geometry.camera_from_world = result.views[v].camera_from_world;
    }
    return moved;
}

std::string refined_views_json(const std::vector<View>& views, const std::vector<ViewOrigin>& origins,
                               const std::filesystem::path& folder) {
    Json list = Json::array();
    for (std::size_t v = 0; v < views.size(); ++v) list.push_back(refined_view(views[v], origins[v], folder));
    return indented({{"raylign", 1}, {"views", list}});
}

}  // namespace raylign::detail::apps
