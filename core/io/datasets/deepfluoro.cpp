#include <algorithm>
#include <cmath>
#include <memory>

#include "core/base/error.h"
#include "core/io/datasets/datasets.h"
#include "core/io/datasets/hdf5_file.h"
#include "core/io/files/text.h"
#include "core/io/views/view_files.h"

namespace raylign::detail {
namespace {

constexpr double kLoaderI0 = 65487;                       // DiffDRR-Datasets, preprocess: initial_energy
constexpr double kLoaderBorder = 50, kLoaderSize = 1536;  // the same: 1536 px are cropped to 1436

/// proj-params.
struct ProjectionParameters {
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
    DatasetIntrinsics intrinsics;
    RigidTransform camera_from_camera_world;
};

int whole_number(const Hdf5File& file, const std::string& name) {
    const double number = file.number(name);
    constexpr double kLargest = 65536;
    if (number >= 1 && number <= kLargest && number == std::round(number)) return static_cast<int>(number);
    throw bad_value("size", number_text(number), "a whole number in [1, 65536]", file.place(name));
}

RigidTransform rigid_in(const Hdf5File& file, const std::string& name) {
    return rigid_from_matrix(Eigen::Matrix4d(file.matrix(name, 4, 4)), file.place(name));
}

ProjectionParameters read_parameters(const Hdf5File& file) {
    const std::string group = "proj-params/";
    ProjectionParameters parameters;
    parameters.size_px = {whole_number(file, group + "num-cols"), whole_number(file, group + "num-rows")};
    const double column_mm =
        positive_mm(file.number(group + "pixel-col-spacing"), file.place(group + "pixel-col-spacing"));
    const double row_mm =
        positive_mm(file.number(group + "pixel-row-spacing"), file.place(group + "pixel-row-spacing"));
    parameters.intrinsics = read_intrinsics(file, group + "intrinsic", column_mm, row_mm);
    parameters.camera_from_camera_world = rigid_in(file, group + "extrinsic");
    return parameters;
}

/// pixels, spacing, origin and dir-mat of a volume: slices, rows, columns.
Raster read_volume_group(const Hdf5File& file, const std::string& group) {
    const Hdf5Array pixels = file.array(group + "/pixels", 3);
    std::vector<int> size;
    for (std::size_t i = 3; i-- > 0;) {
        if (pixels.shape[i] > 65536) {
            throw bad_value("voxels along an axis", std::to_string(pixels.shape[i]), "at most 65536",
                            file.place(group + "/pixels"));
        }
        size.push_back(static_cast<int>(pixels.shape[i]));
    }
    Raster raster = raster_of(pixels, size, FileFormat::meta);
    const Eigen::VectorXd spacing_mm = file.vector(group + "/spacing", 3),
                          origin_mm = file.vector(group + "/origin", 3);
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        raster.spacing_mm[i] = positive_mm(spacing_mm[axis], file.place(group + "/spacing"));
        raster.origin_mm[i] = origin_mm[axis];
    }
    if (file.has(group + "/dir-mat")) raster.direction = file.matrix(group + "/dir-mat", 3, 3);
    return raster;
}

Eigen::Vector3d raster_centre_mm(const Raster& raster) {
    Eigen::Vector3d centre(raster.origin_mm[0], raster.origin_mm[1], raster.origin_mm[2]);
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        centre += raster.direction.col(axis) * raster.spacing_mm[i] * (raster.size[i] - 1) / 2;
    }
    return centre;
}

/// One specimen of an open file: what its views are read with.
struct Specimen {
    explicit Specimen(const std::filesystem::path& path) : file(path) {}

    Hdf5File file;
    std::string name;
    ProjectionParameters parameters;
    Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();
    RigidTransform pelvis_from_world;  ///< of the first view taken
    double i0 = kLoaderI0;

    [[nodiscard]] std::string projection(const std::string& view) const { return name + "/projections/" + view; }
    [[nodiscard]] RigidTransform bone_from_camera_world(const std::string& view, const std::string& bone) const {
        return rigid_in(file, projection(view) + "/gt-poses/cam-to-" + bone + "-vol");
    }
};

const std::string kPelvis = "pelvis";

/// "left-femur" of "cam-to-left-femur-vol"; the pelvis first.
std::vector<std::string> bones_of(const Specimen& specimen, const std::string& view) {
    const std::string before = "cam-to-", after = "-vol";
    std::vector<std::string> bones{kPelvis};
    for (const std::string& name : specimen.file.names(specimen.projection(view) + "/gt-poses")) {
        if (!name.starts_with(before) || !name.ends_with(after)) continue;
        const std::string bone = name.substr(before.size(), name.size() - before.size() - after.size());
        if (bone != kPelvis && is_view_name(bone)) bones.push_back(bone);
    }
    return bones;
}

/// Poses of bones of which too little can be seen are no reference.
void take_poses(const Specimen& specimen, const std::string& view, const RigidTransform& pelvis_from_camera_world,
                ImportedView& result) {
    const RigidTransform camera_world_from_world = inverse(pelvis_from_camera_world) * specimen.pelvis_from_world;
    for (const std::string& bone : bones_of(specimen, view)) {
        const std::string flag = specimen.projection(view) + "/gt-poses/" + bone + "-good-fov";
        if (specimen.file.has(flag) && specimen.file.number(flag) == 0) {
            result.remarks.push_back("too little of the " + bone + " for a reference pose");
            continue;
        }
        const RigidTransform bone_from_world = specimen.bone_from_camera_world(view, bone) * camera_world_from_world;
        result.poses.push_back({bone, inverse(bone_from_world)});
    }
}

void take_points(const Specimen& specimen, const std::string& view, ImportedView& result) {
    const std::string group = specimen.projection(view) + "/gt-landmarks";
    if (!specimen.file.has(group)) return;
    const Eigen::Vector2i& size_px = specimen.parameters.size_px;
    for (const std::string& name : specimen.file.names(group)) {
        const Eigen::Vector2d pixel = specimen.file.any_matrix(group + "/" + name, 2, 1);
        const bool is_inside =
            pixel.allFinite() && pixel.minCoeff() >= 0 && pixel.x() <= size_px.x() - 1 && pixel.y() <= size_px.y() - 1;
        if (is_inside) result.points.push_back({name, pixel});
    }
}

ImportedView read_projection(const Specimen& specimen, const std::string& name) {
    const std::string place = specimen.projection(name);
    const Eigen::Vector2i& size_px = specimen.parameters.size_px;
    ImportedView view{.name = name, .geometry = {}, .image = {}, .is_transmission = true, .i0 = specimen.i0};
    const Hdf5Array pixels = specimen.file.array(place + "/image/pixels", 2);
    if (pixels.shape[0] != static_cast<std::size_t>(size_px.y()) ||
        pixels.shape[1] != static_cast<std::size_t>(size_px.x())) {
        throw bad_value("rows x columns", std::to_string(pixels.shape[0]) + " x " + std::to_string(pixels.shape[1]),
                        "as in proj-params, " + std::to_string(size_px.y()) + " x " + std::to_string(size_px.x()),
                        specimen.file.place(place + "/image/pixels"));
    }
    view.image = raster_of(pixels, {size_px.x(), size_px.y()}, FileFormat::tiff);
    const RigidTransform pelvis_from_camera_world = specimen.bone_from_camera_world(name, kPelvis);
    const ProjectionParameters& parameters = specimen.parameters;
    const RigidTransform camera_from_ct = parameters.camera_from_camera_world * inverse(pelvis_from_camera_world);
    const Eigen::Matrix<double, 3, 4> pixel_from_ct =
        parameters.intrinsics.matrix_px * to_matrix(camera_from_ct).topRows<3>();
    view.geometry = dataset_view(pixel_from_ct, specimen.pelvis_from_world, specimen.centre_ct_mm, size_px,
                                 parameters.intrinsics.sdd_mm, specimen.file.place(place));
    take_points(specimen, name, view);
    take_poses(specimen, name, pelvis_from_camera_world, view);
    const std::string upside_down = place + "/rot-180-for-up";
    if (specimen.file.has(upside_down) && specimen.file.number(upside_down) != 0) {
        view.remarks.emplace_back("rot-180-for-up: the head is at the bottom");
    }
    return view;
}

void take_object(const Specimen& specimen, ImportedCase& result) {
    const Hdf5File& file = specimen.file;
    const std::string segmentation = specimen.name + "/vol-seg";
    if (file.has(segmentation + "/image")) result.labels = read_volume_group(file, segmentation + "/image");
    if (file.has(segmentation + "/labels-def")) {
        for (const std::string& number : file.names(segmentation + "/labels-def")) {
            result.label_names.emplace_back(number, file.text(segmentation + "/labels-def/" + number));
        }
    }
    const std::string landmarks = specimen.name + "/vol-landmarks";
    if (!file.has(landmarks)) return;
    for (const std::string& name : file.names(landmarks)) {
        result.landmarks.push_back({name, file.vector(landmarks + "/" + name, 3)});
    }
}

std::vector<std::string> deepfluoro_conventions(const Specimen& specimen) {
    return {
        "ct: the volume's LPS coordinates, as in the data set.",
        ("world: the \"camera world frame\" of the first view; views.json has the other views where the reference "
         "poses of the pelvis put them. pose = (cam-to-BONE-vol)^-1, brought to that world."),
        ("Pixels: the centre of the first one is (0, 0), columns to the right, rows down, as the data set's own "
         "landmarks have it (DiffDRR's loader takes its corner for the origin: half a pixel beside)."),
        ("The data set's cameras look along -z, with x along columns and y along rows: seen from the source the images "
         "are mirrored, and \"flip\" in views.json turns them on reading. VIEW.tif and points_VIEW.csv are as stored."),
        "rot-180-for-up asks for a turn for display. It is not done: geometry and pixels stay as they are.",
        "Intensities are those of the detector: raylign takes -log(I / " + number_text(specimen.i0) +
            "), the open beam of the public loaders (--i0 for another one), and leaves out the rim that they crop.",
    };
}

/// All groups but proj-params are specimens.
std::vector<std::string> specimens_of(const Hdf5File& file) {
    std::vector<std::string> names = file.names("/");
    std::erase(names, "proj-params");
    return names;
}

int border_px(const DatasetOptions& options, const ProjectionParameters& parameters) {
    const int border = options.border_px.value_or(
        static_cast<int>(std::lround(kLoaderBorder / kLoaderSize * parameters.size_px.minCoeff())));
    if (border >= 0 && 2 * border < parameters.size_px.minCoeff()) return border;
    throw bad_value(
        "--border", std::to_string(border) + " px",
        "at least 0 and less than half of the X-rays' side, " + std::to_string(parameters.size_px.minCoeff()));
}

}  // namespace

ImportedCase read_deepfluoro(const std::filesystem::path& path, const DatasetOptions& options) {
    const auto specimen = std::make_shared<Specimen>(path);
    const Hdf5File& file = specimen->file;
    if (!file.has("proj-params")) {
        throw Error(file.place("proj-params") + " is missing: this is not DeepFluoro's full-resolution file");
    }
    specimen->parameters = read_parameters(file);
    specimen->name = chosen_case(options.case_name, specimens_of(file), "--specimen", path.string());
    specimen->i0 = options.i0.value_or(kLoaderI0);
    ImportedCase result;
    result.title = "DeepFluoro, specimen " + specimen->name;
    result.views = chosen_views(options.views, file.names(specimen->name + "/projections"), path.string());
    if (result.views.empty()) throw Error(file.place(specimen->name + "/projections") + " has no projections");
    result.border_px = border_px(options, specimen->parameters);
    result.volume = read_volume_group(file, specimen->name + "/vol");
    specimen->centre_ct_mm = raster_centre_mm(result.volume);
    specimen->pelvis_from_world = specimen->bone_from_camera_world(result.views.front(), kPelvis);
    take_object(*specimen, result);
    result.conventions = deepfluoro_conventions(*specimen);
    result.read_view = [specimen](const std::string& name) { return read_projection(*specimen, name); };
    return result;
}

}  // namespace raylign::detail
