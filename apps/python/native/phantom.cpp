#include "raylign/phantom.h"

#include <memory>

#include "apps/python/native/bind.h"
#include "apps/python/native/interpreter.h"
#include "raylign/error.h"
#include "raylign/simulate.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::python {
namespace {

Phantom named(const std::string& name, double extent_mm) {
    const Eigen::Vector3d extent = Eigen::Vector3d::Constant(extent_mm);
    if (name == "spine") return spine_phantom(extent);
    if (name == "box") return box_phantom(extent);
    if (name == "ellipsoid") return ellipsoid_phantom(extent);
    throw Error("phantom = " + name + ": must be spine, box or ellipsoid");
}

std::shared_ptr<Volume> voxels(const std::string& name, double extent_mm, int size) {
    const OthersMayRun others_may_run;
    return std::make_shared<Volume>(
        voxelise(named(name, extent_mm),
                 centred_grid(Eigen::Vector3i::Constant(size), Eigen::Vector3d::Constant(extent_mm / size))));
}

/// The view with the phantom's exact X-ray, with photon noise where there are photons.
View xray(const std::string& name, double extent_mm, const View& view, const py::object& world_from_ct, double photons,
          std::uint64_t seed) {
    const RigidTransform pose = pose_from(world_from_ct, "world_from_ct");
    View taken = view;  // now: other threads may change the view as soon as they run
    const OthersMayRun others_may_run;
    taken.image = exact_drr(named(name, extent_mm), view.geometry, pose);
    if (photons > 0) taken.image = with_photon_noise(taken.image, photons, seed);
    return taken;
}

}  // namespace

void bind_phantom(py::module_& module) {
    using namespace py::literals;
    module.def("phantom_volume", &voxels, "name"_a = "spine", "extent_mm"_a = 160.0, "size"_a = 64);
    module.def("phantom_xray", &xray, "name"_a, "extent_mm"_a, "view"_a, "world_from_ct"_a, "photons"_a = 0.0,
               "seed"_a = 1);
}

}  // namespace raylign::detail::python
