#include "apps/python/native/session.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "apps/python/native/bind.h"
#include "apps/python/native/options.h"
#include "raylign/error.h"

namespace raylign::detail::python {
namespace {

std::shared_ptr<SharedBackend> make_backend(const std::string& name, std::optional<int> threads,
                                            const std::string& instruction_set, const std::string& storage,
                                            const std::string& device, const std::string& interpolation, bool crop,
                                            const std::string& solver) {
    BackendOptions options;
    options.cpu.threads = options.gl.threads = options.gl_2006.threads = threads;
    if (!instruction_set.empty()) options.cpu.instruction_set = instruction_set_from_name(instruction_set);
    if (!storage.empty()) {
        options.cpu.storage = storage_from_name(storage);
        options.gl.storage = options.gl_2006.storage = *options.cpu.storage;
    }
    if (!interpolation.empty())
        options.gl.interpolation = options.gl_2006.interpolation = interpolation_from_name(interpolation);
    if (!solver.empty()) options.gl.solver = solver_from_name(solver);
    options.gl.device = options.gl_2006.device = device;
    options.gl.crop = options.gl_2006.crop = crop;
    const OthersMayRun others_may_run;
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
    all["solver"] = info.solver;
    all["has_derivatives"] = info.has_derivatives;
    py::dict passed_over;
    for (const BackendStatus& status : backend.choice.passed_over) passed_over[py::str(status.name)] = status.reason;
    all["passed_over"] = passed_over;
    return all;
}

py::list statuses() {
    std::vector<BackendStatus> all;
    {
        const OthersMayRun others_may_run;
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
        backend, backend->choice.backend->prepare({volume, views, chosen.render, chosen.similarity}), views);
}

std::shared_ptr<SharedSession> with_views(SharedSession& self, const std::vector<View>& views,
                                          const py::dict& options) {
    const RegistrationOptions chosen = options_from(options);
    const AtWork at_work(*self.backend());
    return std::make_shared<SharedSession>(self.backend(), self.session().with_views(views, chosen.similarity), views);
}

py::array_t<double> evaluate(SharedSession& self, const py::object& poses) {
    const std::vector<RigidTransform> world_from_ct = poses_from(poses, "poses");
    py::array_t<double> costs(static_cast<py::ssize_t>(world_from_ct.size()));
    double* values = costs.mutable_data();
    const AtWork at_work(*self.backend());
    self.session().evaluate(world_from_ct, {values, world_from_ct.size()});
    return costs;
}

py::tuple linearize(SharedSession& self, const py::object& poses, const py::object& centre) {
    const auto centre_ct_mm = vector_from<3>(centre, "centre_ct_mm");
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

void check_upstream(const Image& image, const ViewGeometry& view, const std::string& what) {
    const Eigen::Vector2i& size = view.camera.size_px;
    if (image.width != size.x() || image.height != size.y()) {
        throw Error(what + ": must have the shape (" + std::to_string(size.y()) + ", " + std::to_string(size.x()) +
                    ") of the camera, has (" + std::to_string(image.height) + ", " + std::to_string(image.width) + ")");
    }
    if (!std::ranges::all_of(image.pixels, [](float value) { return std::isfinite(value); }))
        throw Error(what + ": must be finite");
}

/// [pose][view]: an array of them, or lists where views differ in size.
std::vector<std::vector<Image>> upstream_from(const py::object& upstream, std::size_t poses,
                                              const std::vector<ViewGeometry>& views) {
    const auto items = [](const py::object& of, const std::string& what, std::size_t count) {
        if (!py::isinstance<py::iterable>(of)) throw Error(what + ": must be an array or lists of images");
        const py::list list(of);
        if (list.size() != count) {
            throw Error(what + ": must have the length " + std::to_string(count) + ", has " +
                        std::to_string(list.size()));
        }
        return list;
    };
    std::vector<std::vector<Image>> images(poses);
    const py::list of_poses = items(upstream, "upstream", poses);
    for (std::size_t i = 0; i < poses; ++i) {
        const std::string what = "upstream[" + std::to_string(i) + "]";
        const py::list of_views = items(of_poses[i], what, views.size());
        for (std::size_t v = 0; v < views.size(); ++v) {
            const std::string which = what + "[" + std::to_string(v) + "]";
            images[i].push_back(image_from(of_views[v], which));
            check_upstream(images[i].back(), views[v], which);
        }
    }
    return images;
}

/// sum over views v and pixels p of U_v(p) dI_v(p) / dt, with the DRRs' derivatives as the backend makes them.
Twist drr_gradient(Session& session, const RigidTransform& world_from_ct, const Eigen::Vector3d& centre_ct_mm,
                   const std::vector<Image>& upstream) {
    Twist gradient = Twist::Zero();
    for (std::size_t v = 0; v < upstream.size(); ++v) {
        const DrrWithDerivatives at = session.render_with_derivatives(world_from_ct, centre_ct_mm, v);
        const std::vector<float>& weights = upstream[v].pixels;
        for (int i = 0; i < 6; ++i) {
            const std::vector<float>& derivative = at.derivatives[i].pixels;
            gradient[i] = std::transform_reduce(weights.begin(), weights.end(), derivative.begin(), gradient[i],
                                                std::plus<>(), [](double u, double d) { return u * d; });
        }
    }
    return gradient;
}

py::array_t<double> drr_gradients(SharedSession& self, const py::object& poses, const py::object& upstream,
                                  const py::object& centre) {
    const auto centre_ct_mm = vector_from<3>(centre, "centre_ct_mm");
    const std::vector<RigidTransform> world_from_ct = poses_from(poses, "poses");
    const auto images = upstream_from(upstream, world_from_ct.size(), self.cameras());
    py::array_t<double> gradients({std::ssize(world_from_ct), py::ssize_t{6}});
    double* values = gradients.mutable_data();
    const AtWork at_work(*self.backend());
    for (std::size_t i = 0; i < world_from_ct.size(); ++i)
        Eigen::Map<Twist>(values + 6 * i) = drr_gradient(self.session(), world_from_ct[i], centre_ct_mm, images[i]);
    return gradients;
}

/// Read under the lock: who works on the session changes them meanwhile.
template <class Read>
auto locked(Read read) {
    return [read](SharedSession& self) {
        const AtWork at_work(*self.backend());
        return read(self.session());
    };
}

/// Poses moved by twists about where each puts the centre: what linearize's derivatives are with respect to.
py::array_t<double> move(const py::object& poses, const py::object& twists, const py::object& centre) {
    const auto centre_ct_mm = vector_from<3>(centre, "centre_ct_mm");
    const std::vector<RigidTransform> from = poses_from(poses, "poses");
    const py::array_t<double> by = numbers(twists, "twists");
    const bool is_list = by.ndim() == 1 || by.ndim() == 2;
    const py::ssize_t count = by.ndim() == 2 ? by.shape(0) : 1;
    if (!is_list || by.shape(by.ndim() - 1) != 6 || (from.size() != 1 && count != std::ssize(from)))
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
             "instruction_set"_a = "", "storage"_a = "", "device"_a = "", "interpolation"_a = "", "crop"_a = false,
             "solver"_a = "")
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
        .def("drr_gradient", &drr_gradients, "poses"_a, "upstream"_a, "centre_ct_mm"_a)
        .def("set_weights", &set_weights, "weights"_a)
        .def("with_views", &with_views, "views"_a, "options"_a)
        .def_property_readonly("view_count", [](SharedSession& self) { return self.session().view_count(); })
        .def_property_readonly("volume_bytes", locked([](const Session& session) { return session.volume_bytes(); }))
        .def_property_readonly("evaluations",
                               locked([](const Session& session) { return session.counters().evaluations; }))
        .def_property_readonly("backend", [](const SharedSession& self) { return self.backend(); });
}

}  // namespace raylign::detail::python
