#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "core/base/error.h"
#include "core/io/datasets/datasets.h"
#include "core/io/datasets/hdf5_file.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr int kMostVoxels = 65536;  // along an axis

/// One patient of an open file.
struct Patient {
    explicit Patient(const std::filesystem::path& path) : file(path) {}

    Hdf5File file;
    std::string name;
    Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();
};

/// Stored x slowest and z fastest, x reversed; here x fastest and growing.
Raster read_patient_volume(const Hdf5File& file, const std::string& group) {
    const Hdf5Array stored = file.array(group + "/pixels", 3);
    if (*std::ranges::max_element(stored.shape) > kMostVoxels) {
        throw bad_value("voxels along an axis", std::to_string(*std::ranges::max_element(stored.shape)),
                        "at most 65536", file.place(group + "/pixels"));
    }
    const std::size_t nx = stored.shape[0], ny = stored.shape[1], nz = stored.shape[2];
    Hdf5Array turned = stored;
    const std::size_t bytes = bytes_of(stored.type);
    for (std::size_t x = 0; x < nx; ++x) {
        for (std::size_t y = 0; y < ny; ++y) {
            for (std::size_t z = 0; z < nz; ++z) {
                const std::size_t from = ((nx - 1 - x) * ny + y) * nz + z, to = (z * ny + y) * nx + x;
                std::memcpy(turned.bytes.data() + to * bytes, stored.bytes.data() + from * bytes, bytes);
            }
        }
    }
    Raster raster =
        raster_of(turned, {static_cast<int>(nx), static_cast<int>(ny), static_cast<int>(nz)}, FileFormat::meta);
    const Eigen::VectorXd spacing_mm = file.vector(group + "/spacing", 3),
                          origin_mm = file.vector(group + "/origin", 3);
    for (int axis = 0; axis < 3; ++axis) {
        raster.spacing_mm[static_cast<std::size_t>(axis)] =
            positive_mm(spacing_mm[axis], file.place(group + "/spacing"));
        raster.origin_mm[static_cast<std::size_t>(axis)] = origin_mm[axis];
    }
    return raster;
}

/// log(max + 1) - log(pixel + 1).
Raster angiogram(const Hdf5Array& pixels, const std::vector<int>& size, const std::string& place) {
    Raster raster = raster_of(pixels, size, FileFormat::tiff);
    std::vector<double> values(raster.pixel_count());
    with_pixels(raster, [&](const auto* stored) { std::copy_n(stored, values.size(), values.begin()); });
    const double highest = *std::ranges::max_element(values);
    std::vector<float> line_integrals;
    for (const double value : values) {
        if (!(value > -1) || !std::isfinite(highest)) {
            throw bad_value("pixel", number_text(value), "a finite number above -1", place);
        }
        line_integrals.push_back(static_cast<float>(std::log(highest + 1) - std::log(value + 1)));
    }
    raster.type = PixelType::f32;
    raster.bytes.resize(line_integrals.size() * sizeof(float));
    std::memcpy(raster.bytes.data(), line_integrals.data(), raster.bytes.size());
    return raster;
}

ImportedView read_angiogram(const Patient& patient, const std::string& name) {
    const std::string group = patient.name + "/proj-" + name;
    const Hdf5File& file = patient.file;
    const Hdf5Array pixels = file.array(group + "/pixels", 2);
    if (std::max(pixels.shape[0], pixels.shape[1]) > static_cast<std::size_t>(kMostVoxels)) {
        throw bad_value("pixels along a side", std::to_string(std::max(pixels.shape[0], pixels.shape[1])),
                        "at most 65536", file.place(group + "/pixels"));
    }
    const Eigen::Vector2i size_px(static_cast<int>(pixels.shape[1]), static_cast<int>(pixels.shape[0]));
    ImportedView view{.name = name, .geometry = {}, .image = {}, .is_transmission = false, .i0 = {}};
    view.image = angiogram(pixels, {size_px.x(), size_px.y()}, file.place(group + "/pixels"));
    const double column_mm = positive_mm(file.number(group + "/col-spacing"), file.place(group + "/col-spacing"));
    const double row_mm = positive_mm(file.number(group + "/row-spacing"), file.place(group + "/row-spacing"));
    const DatasetIntrinsics intrinsics = read_intrinsics(file, group + "/intrinsic", column_mm, row_mm);
    const RigidTransform camera_from_ct =
        rigid_from_matrix(Eigen::Matrix4d(file.matrix(group + "/extrinsic", 4, 4)), file.place(group + "/extrinsic"));
    view.geometry = dataset_view(intrinsics.matrix_px * to_matrix(camera_from_ct).topRows<3>(), {},
                                 patient.centre_ct_mm, size_px, intrinsics.sdd_mm, file.place(group));
    view.poses.push_back({"vessels", {}});
    return view;
}

std::vector<std::string> projections_of(const Patient& patient) {
    std::vector<std::string> views;
    for (const std::string& name : patient.file.names(patient.name)) {
        if (name.starts_with("proj-")) views.push_back(name.substr(5));
    }
    return views;
}

/// By default without the maxima over time: "ap" and "lat".
std::vector<std::string> patient_views(const Patient& patient, const DatasetOptions& options,
                                       const std::string& where) {
    std::vector<std::string> views = projections_of(patient);
    if (options.views.empty()) std::erase_if(views, [](const std::string& view) { return view.ends_with("-max"); });
    if (views.empty()) throw Error(patient.file.place(patient.name) + " has no projections (proj-ap, proj-lat)");
    return chosen_views(options.views, views, where);
}

void take_fiducials(const Patient& patient, ImportedCase& result) {
    const std::string name = patient.name + "/points";
    if (!patient.file.has(name)) return;
    const Hdf5Array points = patient.file.array(name, 2);
    constexpr std::size_t kMost = 100000;
    if (points.shape[1] != 3 || points.shape[0] > kMost) {
        throw bad_value("size", std::to_string(points.shape[0]) + " x " + std::to_string(points.shape[1]),
                        "rows of x, y, z", patient.file.place(name));
    }
    const Eigen::MatrixXd rows = patient.file.matrix(name, static_cast<int>(points.shape[0]), 3);
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        result.landmarks.push_back({"P" + std::to_string(i + 1), rows.row(i).transpose()});
    }
}

/// 7, "07" or "subject07".
std::string patient_name(const std::string& wanted, const std::vector<std::string>& names) {
    for (const std::string& name : names) {
        const auto number = number_from(name.size() > 7 ? name.substr(7) : "");
        if (number && number == number_from(wanted)) return name;
    }
    return wanted;
}

}  // namespace

ImportedCase read_ljubljana(const std::filesystem::path& path, const DatasetOptions& options) {
    const auto patient = std::make_shared<Patient>(path);
    std::vector<std::string> names = patient->file.names("/");
    std::erase_if(names, [](const std::string& name) { return !name.starts_with("subject"); });
    if (names.empty()) {
        throw Error(path.string() + " has no group subjectNN: this is not the data set as DiffDRR's loader has it");
    }
    patient->name = chosen_case(patient_name(options.case_name, names), names, "--patient", path.string());
    ImportedCase result;
    result.title = "Ljubljana cerebral angiograms, " + patient->name;
    result.views = patient_views(*patient, options, path.string());
    result.volume = read_patient_volume(patient->file, patient->name + "/volume");
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        patient->centre_ct_mm[axis] =
            result.volume.origin_mm[i] + result.volume.spacing_mm[i] * (result.volume.size[i] - 1) / 2;
    }
    result.volume_flags = " --bone-threshold 1000";
    take_fiducials(*patient, result);
    result.conventions = {
        ("ct: the data set's own frame of the volume [mm], origin + spacing * index; whether it is LPS the file does "
         "not say."),
        ("world = ct: the extrinsic matrices lead from the volume to the cameras, and every reference pose is the "
         "identity."),
        "The file has the volume with x slowest and reversed; ct.mha has it x fastest and growing.",
        ("ct.mha holds the angiography's own grey values, no HU. --bone-threshold 1000 leaves out what the public "
         "loader sets to 0 (values below 1000)."),
        ("Pixels: the centre of the first one is (0, 0). Seen from the source the images are mirrored; \"flip\" in "
         "views.json turns them on reading."),
        "VIEW.tif holds log(max + 1) - log(pixel + 1), as the public loaders have it: vessels bright.",
    };
    result.read_view = [patient](const std::string& name) { return read_angiogram(*patient, name); };
    return result;
}

}  // namespace raylign::detail
