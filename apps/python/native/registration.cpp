#include "raylign/registration.h"

#include <chrono>
#include <exception>
#include <optional>

#include "apps/python/native/bind.h"
#include "apps/python/native/options.h"
#include "apps/python/native/results.h"
#include "apps/python/native/session.h"
#include "raylign/tracking.h"

namespace raylign::detail::python {
namespace {

/// How often a run asks whether Ctrl-C was pressed: the interpreter's lock may be a switch interval (5 ms) away.
constexpr std::chrono::milliseconds kAskEvery{50};

/// Lets Python watch and stop a run that holds no interpreter lock. What Python raises meanwhile stops the run and is
/// kept, to be raised where the run has ended.
class Watch {
public:
    explicit Watch(py::object on_progress) : on_progress_(std::move(on_progress)) {}

    [[nodiscard]] RunControl control() {
        RunControl control;
        control.stop = stop_.token();
        control.meanwhile = [this] { ask_for_signals(); };
        if (!on_progress_.is_none()) control.on_progress = [this](const RegistrationProgress& at) { tell(at); };
        return control;
    }
    /// Raises what Python raised. `made`: what the run had found until then, kept where it was Ctrl-C.
    void raise(const py::object& made) {
        if (!raised_) return;
        if (!raised_->matches(PyExc_KeyboardInterrupt)) throw py::error_already_set(std::move(*raised_));
        const py::object type = py::module_::import("raylign._native").attr("Interrupted");
        const py::object interrupted = type("interrupted; the best until then is this exception's .result");
        interrupted.attr("result") = made;
        PyErr_SetObject(type.ptr(), interrupted.ptr());
        throw py::error_already_set();
    }

private:
    void ask_for_signals() {
        const auto now = std::chrono::steady_clock::now();
        if (raised_ || now - asked_ < kAskEvery) return;
        asked_ = now;
        const InPython python;
        if (!python) {
            stop_.request_stop();
        } else if (PyErr_CheckSignals() != 0) {
            keep(py::error_already_set());
        }
    }
    void tell(const RegistrationProgress& at) {
        if (raised_) return;
        const InPython python;
        if (!python) return;
        try {
            on_progress_(at.fraction, at.remaining_s, at.cost);
        } catch (py::error_already_set& error) {
            keep(std::move(error));
        }
    }
    void keep(py::error_already_set&& error) {
        raised_.emplace(std::move(error));
        stop_.request_stop();
    }

    py::object on_progress_;
    StopSource stop_;
    std::optional<py::error_already_set> raised_;
    std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now();
};

py::object register_views(const py::object& volume, const py::object& views, const py::object& start,
                          const std::shared_ptr<SharedBackend>& backend, const py::dict& options,
                          const py::object& on_progress) {
    const auto& ct = volume.cast<const Volume&>();
    const auto xrays = views.cast<std::vector<View>>();
    const RigidTransform start_world_from_ct = pose_from(start, "start");
    const RegistrationOptions chosen = options_from(options);
    Watch watch(on_progress);
    RegistrationResult found;
    {
        const AtWork at_work(*backend);
        found = register_volume(ct, xrays, start_world_from_ct, chosen, *backend->choice.backend, watch.control());
    }
    py::object result = py::cast(Result{std::move(found), volume, py::tuple(views), py::cast(backend)});
    watch.raise(result);
    return result;
}

/// A Tracker with what it borrows.
class FrameTracker {
public:
    FrameTracker(const std::shared_ptr<Volume>& volume, const py::object& start,
                 const std::shared_ptr<SharedBackend>& backend, const py::dict& options, const std::string& recovery,
                 std::optional<double> max_jump_mm, double frame_step)
        : volume_(volume), backend_(backend) {
        const RigidTransform start_world_from_ct = pose_from(start, "start");
        const TrackOptions chosen{.registration = options_from(options),
                                  .recovery = search_from_name(recovery),
                                  .max_jump_mm = max_jump_mm,
                                  .frame_step = frame_step};
        const AtWork at_work(*backend_);
        tracker_.emplace(*volume_, start_world_from_ct, chosen, *backend_->choice.backend);
    }
    ~FrameTracker() {
        const AtWork at_work(*backend_);
        tracker_.reset();
    }
    FrameTracker(const FrameTracker&) = delete;
    FrameTracker& operator=(const FrameTracker&) = delete;

    TrackFrame feed(int frame, const std::vector<View>& views) {
        Watch watch{py::none()};
        TrackFrame found;
        {
            const AtWork at_work(*backend_);
            found = tracker_->feed(frame, views, watch.control());
        }
        watch.raise(py::cast(found));
        return found;
    }
    TrackFrame skip(int frame, const std::string& reason) {
        const AtWork at_work(*backend_);
        return tracker_->skip(frame, reason);
    }
    [[nodiscard]] Eigen::Matrix4d predicted(int frame) const {
        const AtWork at_work(*backend_);
        return matrix_of(tracker_->predicted(frame));
    }

private:
    std::shared_ptr<Volume> volume_;
    std::shared_ptr<SharedBackend> backend_;
    std::optional<Tracker> tracker_;
};

}  // namespace

void bind_registration(py::module_& module) {
    using namespace py::literals;
    module.def("register", &register_views, "volume"_a, "views"_a, "start"_a, "backend"_a, "options"_a,
               "on_progress"_a = py::none());
    py::class_<FrameTracker>(module, "Tracker")
        .def(py::init<const std::shared_ptr<Volume>&, const py::object&, const std::shared_ptr<SharedBackend>&,
                      const py::dict&, const std::string&, std::optional<double>, double>(),
             "volume"_a, "start"_a, "backend"_a, "options"_a, "recovery"_a = "auto", "max_jump_mm"_a = py::none(),
             "frame_step"_a = 1.0)
        .def("feed", &FrameTracker::feed, "frame"_a, "views"_a)
        .def("skip", &FrameTracker::skip, "frame"_a, "reason"_a)
        .def("predicted", &FrameTracker::predicted, "frame"_a);
}

}  // namespace raylign::detail::python
