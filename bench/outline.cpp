// How well the voxels that a model is cut into keep its outline, and its triangles once thinned, and what each costs:
//   raylign_outline MODEL VIEWS POSE [--spacing MM ...] [--level MM ...] [--json FILE]
// Exact: the length of each ray inside the surface, the sum of signed depths of the triangles that it meets (a triangle
// that is left counts plus, one that is entered minus: no sorting). Voxels: the DRR of the voxelized model of 1/mm.
// Triangles: the exact lengths of those that `register` keeps, and the time of a DRR from them (2 x 2 rays a pixel).
// The outline is where the length passes through a level, found between pixel centres along rows and columns in both
// images; its error is how far the two crossings are apart, positive where it lies farther out than the exact one.

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>

#include "bench/exact_lengths.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/median.h"
#include "core/io/meshes/mesh_file.h"
#include "core/io/meshes/triangle_mesh.h"
#include "core/io/meshes/voxelize_mesh.h"
#include "raylign/backend.h"
#include "raylign/backends.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"

namespace raylign::detail::bench {
namespace {

constexpr int kReach_px = 3;  // farther apart, crossings belong to other edges
constexpr double kMostVoxels = 4e8;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Where the level is passed between i and i + 1 of a line of pixels, and whether inwards.
struct Crossing {
    double at = 0;
    bool is_rising = false;
};

template <class Line>
std::vector<Crossing> crossings(const Line& value, int count, double level) {
    std::vector<Crossing> found;
    for (int i = 0; i + 1 < count; ++i) {
        const double a = value(i) - level, b = value(i + 1) - level;
        if ((a < 0) != (b < 0)) found.push_back({i + a / (a - b), b > a});
    }
    return found;
}

/// Of each exact crossing the nearest one of the voxels of the same sense: how much farther out that is.
void compare_line(std::span<const Crossing> exact, std::span<const Crossing> voxels, std::vector<double>& errors_px) {
    for (const Crossing& edge : exact) {
        std::optional<double> nearest;
        for (const Crossing& other : voxels) {
            const double outwards = edge.is_rising ? edge.at - other.at : other.at - edge.at;
            if (other.is_rising != edge.is_rising || std::abs(outwards) > kReach_px) continue;
            if (!nearest || std::abs(outwards) < std::abs(*nearest)) nearest = outwards;
        }
        if (nearest) errors_px.push_back(*nearest);
    }
}

std::vector<double> outline_errors_px(const Image& exact, const Image& voxels, double level) {
    std::vector<double> errors_px;
    for (int y = 0; y < exact.height; ++y) {
        const auto row = [y](const Image& image) { return [&image, y](int i) { return double{image(i, y)}; }; };
        compare_line(crossings(row(exact), exact.width, level), crossings(row(voxels), exact.width, level), errors_px);
    }
    for (int x = 0; x < exact.width; ++x) {
        const auto column = [x](const Image& image) { return [&image, x](int i) { return double{image(x, i)}; }; };
        compare_line(crossings(column(exact), exact.height, level), crossings(column(voxels), exact.height, level),
                     errors_px);
    }
    return errors_px;
}

struct Settings {
    std::string model, views, pose;
    std::vector<double> spacings_mm, levels_mm{1.5};
};

/// Least of three.
template <class Work>
double least_ms(const Work& work) {
    double least = 1e9;
    for (int i = 0; i < 3; ++i) {
        const double begin = seconds();
        work();
        least = std::min(least, 1e3 * (seconds() - begin));
    }
    return least;
}

/// A pixel of the view at the model's middle, as `register` chooses voxels.
double pixel_mm(const View& view, const RigidTransform& world_from_ct, const MeshBounds& bounds) {
    const Eigen::Vector3d middle = (bounds.low_mm + bounds.high_mm) / 2;
    const Eigen::Matrix3d& k = view.geometry.camera.intrinsics_px;
    return (view.geometry.camera_from_world * (world_from_ct * middle)).z() / std::max(k(0, 0), k(1, 1));
}

struct Errors {
    double mean = 0, rms = 0, most = 0;  ///< most: of 95 %
};

Errors errors_of(const std::vector<double>& errors_px) {
    Errors found;
    std::vector<double> sizes;
    const auto count = static_cast<double>(errors_px.size());
    for (const double error : errors_px) {
        found.mean += error / count;
        found.rms += error * error / count;
        sizes.push_back(std::abs(error));
    }
    found.rms = std::sqrt(found.rms);
    std::ranges::sort(sizes);
    found.most = sizes[static_cast<std::size_t>(0.95 * (count - 1))];
    return found;
}

void measure(const Settings& settings, Record& record) {
    const TriangleMesh mesh = solid_of(read_mesh(settings.model), settings.model).mesh;
    const View view = read_views(std::vector<std::string>{settings.views}, ReadImages::required).views.front();
    const RigidTransform pose = read_pose(settings.pose);
    Image exact;
    const double exact_ms = least_ms([&] { exact = exact_lengths(mesh, view.geometry, pose); });
    const double pixel = pixel_mm(view, pose, bounds_of(mesh));
    BackendOptions one_thread;
    one_thread.cpu.threads = 1;
    const auto backend = create_backend("cpu", one_thread).backend;
    std::vector<double> spacings = settings.spacings_mm;
    if (spacings.empty()) spacings = {2 * pixel, pixel, pixel / 2};
    const std::string name = settings.model.substr(settings.model.find_last_of('/') + 1);
    for (const double spacing_mm : spacings) {
        Volume volume;
        volume.grid = grid_around(bounds_of(mesh), spacing_mm, kMostVoxels);
        volume.attenuation_per_mm = voxelize_mesh(mesh, volume.grid).share;
        const auto session = backend->prepare({volume, std::vector<View>{view}, {}, {}});
        Image drr;
        const double drr_ms = least_ms([&] { drr = session->render(pose, 0); });
        for (const double level : settings.levels_mm) {
            const Errors found = errors_of(outline_errors_px(exact, drr, level));
            record.add({name, "voxels", spacing_mm, spacing_mm / pixel, level, found.mean, found.rms, found.most,
                        drr_ms, exact_ms});
        }
    }
    // As `register` reads it: thinned by what a thirtieth of a pixel allows.
    const Volume volume = read_volume(settings.model, {.material = "MU=1", .mesh_spacing_mm = 2 * pixel / 3}).volume;
    const auto session = backend->prepare({volume, std::vector<View>{view}, {}, {}});
    const double drr_ms = least_ms([&] { (void)session->render(pose, 0); });
    const TriangleMesh thin{volume.surface->vertices_mm, volume.surface->triangles};
    const Image lengths = exact_lengths(thin, view.geometry, pose);
    for (const double level : settings.levels_mm) {
        const Errors found = errors_of(outline_errors_px(exact, lengths, level));
        record.add({name,
                    std::to_string(thin.triangles.size()) + " triangles of " + std::to_string(mesh.triangles.size()),
                    "", "", level, found.mean, found.rms, found.most, drr_ms, exact_ms});
    }
}

int run(int argc, char** argv) {
    Record record(argc, argv, "Outlines of voxelized models against exact lengths",
                  {"model", "DRR by", "voxels [mm]", "voxels [px]", "outline at a length of [mm]", "mean error [px]",
                   "rms [px]", "95 % below [px]", "DRR, 1 thread [ms]", "exact lengths, 1 thread [ms]"});
    Settings settings;
    CLI::App app("Outlines of voxelized models");
    app.add_option("model", settings.model)->required();
    app.add_option("views", settings.views)->required();
    app.add_option("pose", settings.pose)->required();
    app.add_option("--spacing", settings.spacings_mm);
    app.add_option("--level", settings.levels_mm);
    CLI11_PARSE(app, argc, argv);
    measure(settings, record);
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    return run_program("raylign_outline", [&] { return run(argc, argv); });
}
