#include "apps/python/native/session.h"

#include <optional>

#include "apps/python/native/bind.h"
#include "apps/python/native/options.h"
#include "raylign/error.h"

namespace raylign::detail::python {
namespace {

std::shared_ptr<SharedBackend> make_backend(const std::string& name, std::optional<int> threads,
                                            const std::string& instruction_set, const std::string& storage,
                                            const std::string& device, const std::string& interpolation, bool crop) {
    BackendOptions options;
    options.cpu.threads = threads;
    if (!instruction_set.empty()) options.cpu.instruction_set = instruction_set_from_name(instruction_set);
    if (!storage.empty()) {
        options.cpu.storage = storage_from_name(storage);
        options.gl.storage = options.gl_2006.storage = *options.cpu.storage;
    }
    if (!interpolation.empty())
        options.gl.interpolation = options.gl_2006.interpolation = interpolation_from_name(interpolation);
    options.gl.device = options.gl_2006.device = device;
    options.gl.crop = options.gl_2006.crop = crop;
    const py::gil_scoped_release others_may_run;
    return std::make_shared<SharedBackend>(create_backend(name, options));
}

py::dict info(const SharedBackend& backend) {
    const BackendInfo info = backend.choice.backend->info();
    py::dict all;
    all["name"] = info.name;
    all["device"] = info.device;
    all["threads"] = info.threads;
    all["instruction_set"] = info.instruction_set;
    all["storage"] = info.storage;
    all["interpolation"] = info.interpolation;
    all["has_derivatives"] = info.has_derivatives;
    py::dict passed_over;
    for (const BackendStatus& status : backend.choice.passed_over) passed_over[py::str(status.name)] = status.reason;
    all["passed_over"] = passed_over;
    return all;
}

py::list statuses() {
    std::vector<BackendStatus> all;
    {
        const py::gil_scoped_release others_may_run;
        all = backend_statuses();
    }
    py::list list;
    for (const BackendStatus& status : all) {
        py::dict one;
        one["name"] = status.name;
        one["summary"] = status.summary;
        one["available"] = status.available;
        one["reason"] = status.reason;
        list.append(one);
    }
    return list;
}

std::shared_ptr<SharedSession> prepare(const Volume& volume, const std::vector<View>& views,
                                       const std::shared_ptr<SharedBackend>& backend, const py::dict& options) {
    const RegistrationOptions chosen = options_from(options);
    const AtWork at_work(*backend);
    return std::make_shared<SharedSession>(
        backend, backend->choice.backend->prepare({volume, views, chosen.render, chosen.similarity}));
}

std::shared_ptr<SharedSession> with_views(SharedSession& self, const std::vector<View>& views,
                                          const py::dict& options) {
    const RegistrationOptions chosen = options_from(options);
    const AtWork at_work(*self.backend());
    return std::make_shared<SharedSession>(self.backend(), self.session().with_views(views, chosen.similarity));
}

py::array_t<double> evaluate(SharedSession& self, const py::object& poses) {
    const std::vector<RigidTransform> world_from_ct = poses_from(poses, "poses");
    py::array_t<double> costs(static_cast<py::ssize_t>(world_from_ct.size()));
    double* values = costs.mutable_data();
    const AtWork at_work(*self.backend());
    self.session().evaluate(world_from_ct, {values, world_from_ct.size()});
    return costs;
}

py::tuple linearize(SharedSession& self, const py::object& poses, const Eigen::Vector3d& centre_ct_mm) {
    const std::vector<RigidTransform> world_from_ct = poses_from(poses, "poses");
    std::vector<Linearization> made(world_from_ct.size());
    {
        const AtWork at_work(*self.backend());
        self.session().linearize(world_from_ct, centre_ct_mm, made);
    }
    const auto count = static_cast<py::ssize_t>(made.size());
    py::array_t<double> costs(count), gradients({count, py::ssize_t{6}});
    py::array_t<double> curvatures({count, py::ssize_t{6}, py::ssize_t{6}});
    for (py::ssize_t i = 0; i < count; ++i) {
        const Linearization& one = made[static_cast<std::size_t>(i)];
        costs.mutable_at(i) = one.cost;
        for (int row = 0; row < 6; ++row) {
            gradients.mutable_at(i, row) = one.gradient[row];
            for (int column = 0; column < 6; ++column)
                curvatures.mutable_at(i, row, column) = one.curvature(row, column);
        }
    }
    return py::make_tuple(costs, gradients, curvatures);
}

py::object render(SharedSession& self, const py::object& pose, std::size_t view) {
    const RigidTransform world_from_ct = pose_from(pose, "pose");
    if (view >= self.session().view_count()) {
        throw py::index_error("view = " + std::to_string(view) + ": there are " +
                              std::to_string(self.session().view_count()));
    }
    Image image;
    {
        const AtWork at_work(*self.backend());
        image = self.session().render(world_from_ct, view);
    }
    return image_array(std::move(image));
}

/// Poses moved by twists about where each puts the centre: what linearize's derivatives are with respect to.
py::array_t<double> move(const py::object& poses, const py::object& twists, const Eigen::Vector3d& centre_ct_mm) {
    const std::vector<RigidTransform> from = poses_from(poses, "poses");
    const py::array_t<double> by = numbers(twists, "twists");
    const py::ssize_t count = by.ndim() == 1 ? 1 : by.shape(0);
    if (by.ndim() > 2 || by.shape(by.ndim() - 1) != 6 || (from.size() != 1 && count != std::ssize(from)))
        throw Error("twists: must have the shape (6,) or (N, 6) for " + std::to_string(from.size()) + " poses, has " +
                    shape_text(by));
    py::array_t<double> moved({count, py::ssize_t{4}, py::ssize_t{4}});
    for (py::ssize_t i = 0; i < count; ++i) {
        const RigidTransform& pose = from[from.size() == 1 ? 0 : static_cast<std::size_t>(i)];
        const Twist twist = Eigen::Map<const Twist>(by.data() + 6 * i);
        const RigidTransform step = exp_about(twist, pose * centre_ct_mm);
        Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(moved.mutable_data() + 16 * i) =
            to_matrix(step * pose);
    }
    return moved;
}

void set_weights(SharedSession& self, const std::vector<py::object>& weights) {
    std::vector<Image> images;
    for (std::size_t v = 0; v < weights.size(); ++v)
        images.push_back(image_from(weights[v], "weights[" + std::to_string(v) + "]"));
    const AtWork at_work(*self.backend());
    self.session().set_weights(images);
}

}  // namespace

SharedSession::~SharedSession() {
    const AtWork at_work(*backend_);
    session_.reset();
}

void bind_session(py::module_& module) {
    using namespace py::literals;
    py::class_<SharedBackend, std::shared_ptr<SharedBackend>>(module, "Backend")
        .def(py::init(&make_backend), "name"_a = "auto", py::kw_only(), "threads"_a = py::none(),
             "instruction_set"_a = "", "storage"_a = "", "device"_a = "", "interpolation"_a = "", "crop"_a = false)
        .def_property_readonly("info", &info)
        .def_property_readonly("name", [](const SharedBackend& backend) { return backend.choice.backend->info().name; })
        .def("__repr__", [](const SharedBackend& backend) {
            const BackendInfo info = backend.choice.backend->info();
            return "<raylign.Backend " + info.name + " on " + info.device + ">";
        });
    module.def("backends", &statuses);
    module.def("move", &move, "poses"_a, "twists"_a, "centre_ct_mm"_a);
    py::class_<SharedSession, std::shared_ptr<SharedSession>>(module, "Session")
        .def(py::init(&prepare), "volume"_a, "views"_a, "backend"_a, "options"_a)
        .def("evaluate", &evaluate, "poses"_a)
        .def("linearize", &linearize, "poses"_a, "centre_ct_mm"_a)
        .def("render", &render, "pose"_a, "view"_a = 0)
        .def("set_weights", &set_weights, "weights"_a)
        .def("with_views", &with_views, "views"_a, "options"_a)
        .def_property_readonly("view_count", [](SharedSession& self) { return self.session().view_count(); })
        .def_property_readonly("volume_bytes", [](SharedSession& self) { return self.session().volume_bytes(); })
        .def_property_readonly("evaluations", [](SharedSession& self) { return self.session().counters().evaluations; })
        .def_property_readonly("backend", [](const SharedSession& self) { return self.backend(); });
}

}  // namespace raylign::detail::python
