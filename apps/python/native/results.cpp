#include "apps/python/native/results.h"

#include "apps/python/native/bind.h"
#include "raylign/tracking.h"

namespace raylign::detail::python {
namespace {

py::list history(const RegistrationResult& result) {
    py::list list;
    for (const IterationRecord& record : result.history) {
        py::dict one;
        one["level"] = record.level;
        one["iteration"] = record.iteration;
        one["cost"] = record.cost;
        one["step_mm"] = record.step_mm;
        one["world_from_ct"] = matrix_of(record.world_from_ct);
        list.append(one);
    }
    return list;
}

py::list levels(const RegistrationResult& result) {
    py::list list;
    for (const LevelReport& level : result.levels) {
        py::dict one;
        one["volume_size"] = level.volume_size;
        one["spacing_mm"] = level.spacing_mm;
        one["image_sizes_px"] = level.image_sizes_px;
        one["content"] = content_name(level.content);
        one["sigma_px"] = level.filter.sigma_px;
        one["cost_initial"] = level.cost_initial;
        one["cost_final"] = level.cost_final;
        one["iterations"] = level.iterations;
        one["evaluations"] = level.evaluations;
        one["linearizations"] = level.linearizations;
        one["termination"] = termination_name(level.termination);
        one["time_s"] = level.time_s;
        list.append(one);
    }
    return list;
}

py::list rivals(const RegistrationResult& result) {
    py::list list;
    for (const Rival& rival : result.search.rivals) {
        py::dict one;
        one["world_from_ct"] = matrix_of(rival.world_from_ct);
        one["cost"] = rival.cost;
        one["shift_mm"] = rival.shift_mm;
        one["rotation_deg"] = rival.rotation_deg;
        list.append(one);
    }
    return list;
}

py::list corrections(const RegistrationResult& result) {
    py::list list;
    for (const ViewResult& view : result.views) {
        const ViewCorrection& correction = view.correction;
        if (!correction.is_estimated) {
            list.append(py::none());
            continue;
        }
        py::dict one;
        one["rotation_deg"] = correction.rotation_deg;
        one["rotation_sigma_deg"] = correction.rotation_sigma_deg;
        one["translation_mm"] = correction.translation_mm;
        one["translation_sigma_mm"] = correction.translation_sigma_mm;
        one["centre_world_mm"] = correction.centre_world_mm;
        one["significance"] = correction.significance;
        one["effect_mm"] = correction.effect_mm;
        one["applied"] = correction.is_applied;
        one["doubtful"] = correction.is_doubtful;
        one["camera_from_world"] = matrix_of(view.camera_from_world);
        list.append(one);
    }
    return list;
}

py::object covariance(const RegistrationResult& result) {
    if (!result.confidence.is_estimated) return py::none();
    return py::cast(Eigen::MatrixXd(result.confidence.covariance));
}

/// What the summary of the program says of how sure the pose is; None where it is not estimated or withheld.
py::object confidence(const RegistrationResult& result) {
    const Confidence& sure = result.confidence;
    if (!sure.is_estimated) return py::none();
    py::dict all;
    all["expected_error_mm"] = sure.rim_mm;
    all["translation_mm"] = sure.translation_mm;
    all["rotation_deg"] = sure.rotation_deg;
    all["weakest_direction"] = sure.weakest_direction;
    all["weakest_mm"] = sure.weakest_mm;
    all["weakest_axis"] = sure.weakest_axis;
    all["weakest_deg"] = sure.weakest_deg;
    if (sure.in_depth_mm > 0) {
        all["in_depth_mm"] = sure.in_depth_mm;
        all["in_plane_mm"] = sure.in_plane_mm;
    }
    return all;
}

py::object expected_error(const RegistrationResult& result) {
    return result.confidence.is_estimated ? py::cast(result.confidence.rim_mm) : py::none();
}

/// Member of the result that the Python object is made of.
template <class Member>
auto field(Member RegistrationResult::*member) {
    return [member](const Result& self) { return self.found.*member; };
}
template <class Made>
auto made(Made make) {
    return [make](const Result& self) { return make(self.found); };
}

void bind_result(py::module_& module) {
    using R = RegistrationResult;
    py::class_<Result>(module, "Result")
        .def_property_readonly("world_from_ct", made([](const R& r) { return matrix_of(r.world_from_ct); }))
        .def_property_readonly("ct_from_world", made([](const R& r) { return matrix_of(inverse(r.world_from_ct)); }))
        .def_property_readonly("start_world_from_ct", made([](const R& r) { return matrix_of(r.start_world_from_ct); }))
        .def_property_readonly("ok", field(&R::ok))
        .def_property_readonly("reasons", field(&R::reasons))
        .def_property_readonly("decisions", field(&R::decisions))
        .def_property_readonly("termination", made([](const R& r) { return termination_name(r.termination); }))
        .def_property_readonly("method", made([](const R& r) { return method_name(r.method); }))
        .def_property_readonly("metric", made([](const R& r) { return metric_name(r.metric); }))
        .def_property_readonly("content", made([](const R& r) { return content_name(r.content); }))
        .def_property_readonly("cost_initial", field(&R::cost_initial))
        .def_property_readonly("cost_final", field(&R::cost_final))
        .def_property_readonly("view_costs", field(&R::view_costs))
        .def_property_readonly("overlap", field(&R::overlap))
        .def_property_readonly("rotation_centre", field(&R::rotation_centre_ct_mm))
        .def_property_readonly("expected_error_mm", made(&expected_error))
        .def_property_readonly("covariance", made(&covariance))
        .def_property_readonly("confidence", made(&confidence))
        .def_property_readonly("corrections", made(&corrections))
        .def_property_readonly("levels", made(&levels))
        .def_property_readonly("history", made(&history))
        .def_property_readonly("search", made([](const R& r) { return search_name(r.search.mode); }))
        .def_property_readonly("rivals", made(&rivals))
        .def_property_readonly("iterations", field(&R::iterations))
        .def_property_readonly("time_s", field(&R::total_s))
        .def_readonly("volume", &Result::volume)
        .def_readonly("views", &Result::views)
        .def_readonly("backend", &Result::backend)
        .def("__str__", made([](const R& r) { return full(r); }))
        .def("__repr__", made([](const R& r) { return "<raylign.Result " + brief(r) + ">"; }));
}

void bind_track_frame(py::module_& module) {
    using F = TrackFrame;
    py::class_<F>(module, "TrackFrame")
        .def_readonly("frame", &F::frame)
        .def_property_readonly("status", [](const F& f) { return status_name(f.status); })
        .def_property_readonly("ok", [](const F& f) { return f.status == TrackStatus::ok; })
        .def_property_readonly("world_from_ct", [](const F& f) { return matrix_of(f.world_from_ct); })
        .def_property_readonly("predicted_world_from_ct",
                               [](const F& f) { return matrix_of(f.predicted_world_from_ct); })
        .def_readonly("jump_mm", &F::jump_mm)
        .def_readonly("cost", &F::cost)
        .def_readonly("view_costs", &F::view_costs)
        .def_property_readonly(
            "expected_error_mm",
            [](const F& f) { return f.expected_error_mm > 0 ? py::cast(f.expected_error_mm) : py::none(); })
        .def_property_readonly("searched", [](const F& f) { return search_name(f.searched); })
        .def_readonly("recovered", &F::recovered)
        .def_readonly("reasons", &F::reasons)
        .def_readonly("time_s", &F::time_s)
        .def("__repr__", [](const F& f) {
            return "<raylign.TrackFrame " + std::to_string(f.frame) + " " + std::string(status_name(f.status)) + ">";
        });
}

}  // namespace

void bind_results(py::module_& module) {
    bind_result(module);
    bind_track_frame(module);
}

}  // namespace raylign::detail::python
