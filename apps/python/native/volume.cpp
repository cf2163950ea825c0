#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "apps/python/native/bind.h"
#include "apps/python/native/interpreter.h"
#include "raylign/error.h"
#include "raylign/intensity.h"
#include "raylign/io/volume.h"
#include "raylign/targets.h"

namespace raylign::detail::python {
namespace {

constexpr double kOrthonormal = 1e-4;  // files carry few digits

VoxelGrid grid_of(const py::array& array, const Eigen::Vector3d& spacing_mm, const Eigen::Vector3d& origin_mm,
                  const Eigen::Matrix3d& direction) {
    if (array.ndim() != 3 || array.size() == 0)
        throw Error("array: must have the shape (slices, rows, columns), has " + shape_text(array));
    for (int axis = 0; axis < 3; ++axis) {
        if (array.shape(axis) > std::numeric_limits<int>::max()) throw Error("array: too large: " + shape_text(array));
        if (!(spacing_mm[axis] > 0 && std::isfinite(spacing_mm[axis])))
            throw Error("spacing = " + std::to_string(spacing_mm[axis]) + " mm: must be positive and finite");
    }
    if (!origin_mm.allFinite()) throw Error("origin: must be finite");
    if (!((direction.transpose() * direction - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kOrthonormal))
        throw Error("direction: its columns must be orthonormal");
    VoxelGrid grid;
    grid.size = Eigen::Vector3i(static_cast<int>(array.shape(2)), static_cast<int>(array.shape(1)),
                                static_cast<int>(array.shape(0)));
    grid.spacing_mm = spacing_mm;
    grid.origin_mm = origin_mm;
    grid.direction = direction;
    return grid;
}

void check_finite(const float* values, std::size_t slice, const VoxelGrid& grid) {
    const std::size_t columns = grid.size.x(), count = columns * grid.size.y();
    for (std::size_t i = 0; i < count; ++i) {
        if (std::isfinite(values[i])) continue;
        throw Error("array[" + std::to_string(slice) + ", " + std::to_string(i / columns) + ", " +
                    std::to_string(i % columns) + "] = " + std::to_string(values[i]) + ": must be finite");
    }
}

std::shared_ptr<Volume> volume_from(const py::object& object, const py::object& spacing, const py::object& origin,
                                    const py::object& direction, const std::string& unit,
                                    const std::string& hu_preset_name) {
    if (unit != "HU" && unit != "1/mm") throw Error("unit = " + unit + ": must be HU or 1/mm");
    const HuPreset& preset = hu_preset_name.empty() ? hu_presets().front() : hu_preset(hu_preset_name);
    const py::array array = real_array(object, "array");
    auto volume = std::make_shared<Volume>();
    volume->grid = grid_of(array, vector_from<3>(spacing, "spacing"), vector_from<3>(origin, "origin"),
                           matrix_from<3, 3>(direction, "direction"));
    std::vector<float>& voxels = volume->attenuation_per_mm;
    voxels.reserve(static_cast<std::size_t>(array.size()));
    for (py::ssize_t k = 0; k < array.shape(0); ++k) {  // slice by slice: of other types no second volume is made
        const py::array_t<float> slice = floats(array[py::int_(k)], "array");
        check_finite(slice.data(), static_cast<std::size_t>(k), volume->grid);
        voxels.insert(voxels.end(), slice.data(), slice.data() + slice.size());
    }
    if (unit == "HU") {
        for (float& voxel : voxels) voxel = attenuation_from_hu(voxel, preset);
    }
    return volume;
}

/// The voxels themselves, read only: a Volume never changes once it is made.
py::array attenuation(const py::object& self) {
    const Volume& volume = self.cast<const Volume&>();
    const Eigen::Vector3i& size = volume.grid.size;
    py::array_t<float> array({size.z(), size.y(), size.x()}, volume.attenuation_per_mm.data(), self);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

std::string volume_repr(const Volume& volume) {
    const Eigen::Vector3i& size = volume.grid.size;
    const auto& spacing = volume.grid.spacing_mm;
    return "<raylign.Volume " + std::to_string(size.x()) + " x " + std::to_string(size.y()) + " x " +
           std::to_string(size.z()) + " voxels of " +
           py::str("{:g} x {:g} x {:g}").format(spacing.x(), spacing.y(), spacing.z()).cast<std::string>() + " mm>";
}

std::pair<std::shared_ptr<Volume>, std::vector<std::string>> read_ct(
    const std::filesystem::path& path, const std::optional<std::filesystem::path>& labels,
    const std::vector<std::string>& label_names, const std::vector<std::int32_t>& label_numbers,
    const std::optional<double>& bone_threshold_hu, const std::string& series, const std::string& preset,
    bool is_attenuation, double hu_offset) {
    const OthersMayRun others_may_run;
    VolumeReadOptions options;
    options.hu_preset = preset;
    options.is_attenuation = is_attenuation;
    options.hu_offset = hu_offset;
    options.series = series;
    if (labels) options.object.label_map = *labels;
    options.object.label_names = label_names;
    options.object.labels = label_numbers;
    options.object.bone_threshold_hu = bone_threshold_hu;
    VolumeFile file = read_volume(path, options);
    return {std::make_shared<Volume>(std::move(file.volume)), std::move(file.notes)};
}

}  // namespace

void bind_volume(py::module_& module) {
    using namespace py::literals;
    py::class_<Volume, std::shared_ptr<Volume>>(module, "Volume", py::dynamic_attr())
        .def(py::init(&volume_from), "array"_a, "spacing"_a, "origin"_a = Eigen::Vector3d::Zero().eval(),
             "direction"_a = Eigen::Matrix3d::Identity().eval(), py::kw_only(), "unit"_a = "HU", "hu_preset"_a = "")
        .def_property_readonly("attenuation", &attenuation)
        .def_property_readonly("shape",
                               [](const Volume& volume) {
                                   const Eigen::Vector3i& size = volume.grid.size;
                                   return py::make_tuple(size.z(), size.y(), size.x());
                               })
        .def_property_readonly("spacing", [](const Volume& volume) { return volume.grid.spacing_mm; })
        .def_property_readonly("origin", [](const Volume& volume) { return volume.grid.origin_mm; })
        .def_property_readonly("direction", [](const Volume& volume) { return volume.grid.direction; })
        .def_property_readonly("centre", [](const Volume& volume) { return volume.grid.centre_ct_mm(); })
        .def("__repr__", &volume_repr);
    module.def("read_volume", &read_ct, "path"_a, py::kw_only(), "labels"_a = py::none(),
               "label_names"_a = std::vector<std::string>(), "label_numbers"_a = std::vector<std::int32_t>(),
               "bone_threshold_hu"_a = py::none(), "series"_a = "", "hu_preset"_a = "", "is_attenuation"_a = false,
               "hu_offset"_a = 0.0);
    module.def(
        "write_volume",
        [](const std::filesystem::path& path, const Volume& volume) {
            const OthersMayRun others_may_run;
            write_volume(path, volume);
        },
        "path"_a, "volume"_a);
    module.def(
        "default_targets",
        [](const Volume& volume, int count) { return points_array(default_targets_ct_mm(volume, count)); }, "volume"_a,
        "count"_a = 100);
}

}  // namespace raylign::detail::python
