#include "apps/python/native/options.h"

#include <cmath>
#include <functional>
#include <map>

#include "raylign/error.h"

namespace raylign::detail::python {
namespace {

using Value = const py::object&;
using Setter = std::function<void(RegistrationOptions&, Value)>;

/// Half a filter's taps, where only its width is given.
int radius_for(double sigma_px) { return std::max(1, static_cast<int>(std::ceil(3 * sigma_px))); }

ViewPrior prior_from(Value value) {
    if (py::isinstance<py::bool_>(value)) return {};
    const auto [degrees, mm] = value.cast<std::pair<double, double>>();
    return {.rotation_deg = degrees, .translation_mm = mm};
}

const std::map<std::string, Setter>& setters() {
    static const std::map<std::string, Setter> all{
        {"method", [](auto& o, Value v) { o.method = method_from_name(v.cast<std::string>()); }},
        {"metric", [](auto& o, Value v) { o.similarity.metric = metric_from_name(v.cast<std::string>()); }},
        {"sigma_px",
         [](auto& o, Value v) {
             const auto sigma_px = v.cast<double>();
             o.similarity.filter = {.sigma_px = sigma_px, .radius_px = radius_for(sigma_px)};
         }},
        {"projector", [](auto& o, Value v) { o.render.projector = projector_from_name(v.cast<std::string>()); }},
        {"step_mm", [](auto& o, Value v) { o.render.step_mm = v.cast<double>(); }},
        {"levels", [](auto& o, Value v) { o.levels = v.cast<int>(); }},
        {"max_iterations", [](auto& o, Value v) { o.max_iterations_per_level = v.cast<int>(); }},
        {"content", [](auto& o, Value v) { o.content = content_from_name(v.cast<std::string>()); }},
        {"search", [](auto& o, Value v) { o.search.mode = search_from_name(v.cast<std::string>()); }},
        {"range_mm", [](auto& o, Value v) { o.search.range_mm = v.cast<double>(); }},
        {"range_deg", [](auto& o, Value v) { o.search.range_deg = v.cast<double>(); }},
        {"starts", [](auto& o, Value v) { o.search.starts = v.cast<int>(); }},
        {"seed", [](auto& o, Value v) { o.search.seed = v.cast<std::uint64_t>(); }},
        {"robust", [](auto& o, Value v) { o.robust = v.cast<bool>(); }},
        {"look_around", [](auto& o, Value v) { o.look_around = v.cast<bool>(); }},
        {"suspect_mirrored", [](auto& o, Value v) { o.suspect_mirrored = v.cast<bool>(); }},
        {"compare_views", [](auto& o, Value v) { o.compare_views = v.cast<bool>(); }},
        {"refine_views", [](auto& o, Value v) { o.refine_views = prior_from(v); }},
        {"time_limit_s", [](auto& o, Value v) { o.time_limit_s = v.cast<double>(); }},
        {"rotation_centre", [](auto& o, Value v) { o.rotation_centre_ct_mm = v.cast<Eigen::Vector3d>(); }},
    };
    return all;
}

}  // namespace

RegistrationOptions options_from(const py::dict& options) {
    RegistrationOptions chosen;
    for (const auto& [key, value] : options) {
        const auto name = key.cast<std::string>();
        const auto found = setters().find(name);
        if (found == setters().end()) throw Error("option " + name + ": there is no such option");
        const auto object = py::reinterpret_borrow<py::object>(value);
        const bool is_off = py::isinstance<py::bool_>(object) && name == "refine_views" && !object.cast<bool>();
        if (object.is_none() || is_off) continue;
        try {
            found->second(chosen, object);
        } catch (const py::cast_error&) {
            throw Error("option " + name + " = " + py::repr(object).cast<std::string>() + ": has the wrong type");
        }
    }
    return chosen;
}

}  // namespace raylign::detail::python
