// What a model's triangles are worth where DRRs are made from them instead of from voxels: one descent by each, from
// the same start on the same simulated X-ray, everything else alike.
//   raylign_triangles MODEL VIEWS POSE [--material M] [--poses N] [--first N] [--sigma PX] [--json FILE]
// VIEWS has the camera (and an image, whose pixels do not count), POSE is where truth is near; truth, X-ray and start
// as raylign_implant has them. voxels: of two thirds of a pixel, the spacing chosen unasked. Both by the backend cpu on
// one thread, on the object's window; filtered and summed by the oracle's code, the fine filter of a part's finish,
// without robust weights. Where they end tells what each makes of an outline.

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <functional>
#include <iostream>
#include <numbers>

#include "bench/implant_xray.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/median.h"
#include "core/image/transmission.h"
#include "core/image/view_crop.h"
#include "core/io/meshes/material.h"
#include "core/io/meshes/mesh_file.h"
#include "core/optimize/levenberg_marquardt.h"
#include "core/registration/object/pose_space.h"
#include "core/similarity/linearization.h"
#include "raylign/backends.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"

namespace raylign::detail::bench {
namespace {

constexpr double kVoxel_px = 2.0 / 3;
constexpr int kMargin_px = 40;

struct Settings : ImplantXray {
    std::string model, views, pose, material = "cobalt-chrome";
    int poses = 8, first = 0;
    double sigma_px = 0.75;
};

struct Model {
    TriangleMesh mesh;
    double mu_per_mm = 0;
    Volume volume;
    ObjectExtent extent;
};

using Drawing = std::function<DrrWithDerivatives(const View& view, const RigidTransform& world_from_ct)>;

struct Engine {
    std::string name;
    Drawing draw;
    std::vector<double> draw_s = {}, depth_mm = {}, plane_mm = {}, turn_deg = {}, linearizations = {};
};

/// Cost and derivatives in PoseSpace's parameters.
LocalModel model_at(Engine& engine, const View& view, const FixedChannels& fixed, const Similarity& similarity,
                    const ObjectExtent& extent, const RigidTransform& pose) {
    const double begin = processor_s();
    const DrrWithDerivatives made = engine.draw(view, pose);
    engine.draw_s.push_back(processor_s() - begin);
    const std::vector<Image> moving = moving_channels(made.drr, similarity);
    std::vector<std::array<Image, 6>> changes(moving.size());
    for (std::size_t p = 0; p < 6; ++p) {
        std::vector<Image> channels = moving_channels(made.derivatives[p], similarity);
        for (std::size_t c = 0; c < channels.size(); ++c) changes[c][p] = std::move(channels[c]);
    }
    std::vector<JacobianSums> sums;
    for (std::size_t c = 0; c < moving.size(); ++c) {
        sums.push_back(jacobian_sums(fixed.channels[c], moving[c], changes[c], fixed.weights));
    }
    const Linearization at = linearize_view(sums);
    Eigen::Matrix<double, 6, 1> scale = Eigen::Matrix<double, 6, 1>::Ones();
    scale.head<3>().setConstant(1 / extent.radius_mm);
    return {at.cost, scale.cwiseProduct(at.gradient), scale.asDiagonal() * at.curvature * scale.asDiagonal()};
}

void descend(Engine& engine, const View& view, const Similarity& similarity, const ObjectExtent& extent,
             const RigidTransform& start, const RigidTransform& truth) {
    const FixedChannels fixed = make_fixed_channels(view, similarity);
    const auto at = [&](const RigidTransform& pose) { return model_at(engine, view, fixed, similarity, extent, pose); };
    RigidTransform pose = start;
    LevenbergMarquardtSearch search(at(pose), {.step_tolerance = 1e-3, .decrease_tolerance = 1e-10, .learns = true});
    while (!search.done()) {
        const RigidTransform trial = make_pose_space(pose, extent).pose(search.step());
        if (search.take(at(trial))) pose = trial;
    }
    const Eigen::Vector3d true_mm = truth * extent.centre_ct_mm, off_mm = pose * extent.centre_ct_mm - true_mm;
    const Eigen::Vector3d axis = (true_mm - source_world_mm(view.geometry)).normalized();
    engine.depth_mm.push_back(off_mm.dot(axis));
    engine.plane_mm.push_back((off_mm - off_mm.dot(axis) * axis).norm());
    engine.turn_deg.push_back(Eigen::AngleAxisd(pose.rotation * truth.rotation.transpose()).angle() * 180 /
                              std::numbers::pi);
    engine.linearizations.push_back(search.result().linearizations);
    std::cout << engine.name << ": depth " << engine.depth_mm.back() << ", in plane " << engine.plane_mm.back()
              << " mm, turn " << engine.turn_deg.back() << " degrees, cost " << search.result().model.cost
              << ", at the truth " << at(truth).cost << ", " << search.result().linearizations
              << " linearizations, DRR with derivatives " << 1e3 * median(engine.draw_s) << " ms" << std::endl;
}

/// The two ways that a session makes a model's DRRs.
struct Sessions {
    std::unique_ptr<Session> resident, current;
};

std::vector<Engine> engines_of(const Model& model, std::array<Sessions, 2>& sessions) {
    const Eigen::Vector3d centre = model.extent.centre_ct_mm;
    std::vector<Engine> engines;
    for (std::size_t i = 0; i < sessions.size(); ++i) {
        const Sessions& own = sessions[i];
        engines.push_back({i == 0 ? "voxels" : "triangles", [&own, centre](const View&, const RigidTransform& pose) {
                               return own.current->render_with_derivatives(pose, centre, 0);
                           }});
    }
    return engines;
}

double rms(const std::vector<double>& values) {
    const Eigen::Map<const Eigen::ArrayXd> all(values.data(), std::ssize(values));
    return std::sqrt(all.square().mean());
}

double mean(const std::vector<double>& values) {
    return Eigen::Map<const Eigen::ArrayXd>(values.data(), std::ssize(values)).mean();
}

void measure(const Settings& settings, Record& record) {
    Model model;
    model.mesh = solid_of(read_mesh(settings.model), settings.model).mesh;
    const View camera = read_views(std::vector<std::string>{settings.views}, ReadImages::required).views.front();
    const RigidTransform near = read_pose(settings.pose);
    const MeshBounds bounds = bounds_of(model.mesh);
    const Eigen::Vector3d middle_ct = (bounds.low_mm + bounds.high_mm) / 2;
    const double depth_mm = (camera.geometry.camera_from_world * (near * middle_ct)).z();
    model.mu_per_mm = attenuation_of_material(settings.material, hu_presets().front());
    const double voxel_mm = kVoxel_px * depth_mm / camera.geometry.camera.intrinsics_px(0, 0);
    model.volume = read_volume(settings.model, {.material = settings.material, .mesh_spacing_mm = voxel_mm}).volume;
    model.extent = object_extent(model.volume);
    const Similarity similarity{Metric::gc,
                                {settings.sigma_px, std::max(2, static_cast<int>(std::ceil(3 * settings.sigma_px)))}};
    BackendOptions one_thread;
    one_thread.cpu.threads = 1;
    const auto backend = create_backend("cpu", one_thread).backend;
    Volume voxels = model.volume;
    voxels.surface.reset();
    std::array<Sessions, 2> sessions;
    std::vector<Engine> engines = engines_of(model, sessions);
    for (int i = settings.first; i < settings.first + settings.poses; ++i) {
        Random random(static_cast<std::uint64_t>(i));
        const RigidTransform truth = moved(near, near * middle_ct, 10, 10, random);
        const RigidTransform start = moved(truth, truth * middle_ct, 2, 2, random);
        View view = shown_on(model.mesh, model.mu_per_mm, camera, truth, settings, i);
        view.by_transmission = true;
        view = as_compared({&view, 1}).front();
        view = crop(view, reached_pixels(view.geometry, model.volume.grid, truth, kMargin_px));
        for (std::size_t k = 0; k < sessions.size(); ++k) {
            Sessions& own = sessions[k];
            if (!own.resident) {
                own.resident = backend->prepare({k == 0 ? voxels : model.volume, {&view, 1}, {}, similarity});
            }
            own.current = own.resident->with_views({&view, 1}, similarity);
        }
        for (Engine& engine : engines) descend(engine, view, similarity, model.extent, start, truth);
    }
    const std::string name = settings.model.substr(settings.model.find_last_of('/') + 1);
    for (const Engine& engine : engines) {
        record.add({name, engine.name, 1e3 * median(engine.draw_s), mean(engine.depth_mm), rms(engine.depth_mm),
                    median(engine.plane_mm), median(engine.turn_deg), median(engine.linearizations)});
    }
}

int run(int argc, char** argv) {
    Record record(argc, argv, "A model by its voxels and by its triangles",
                  {"model", "DRR by", "DRR with derivatives, 1 thread, p50 [ms]", "depth, mean [mm]", "depth, rms [mm]",
                   "in plane, p50 [mm]", "turn, p50 [deg]", "linearizations, p50"});
    Settings settings;
    settings.blur_mm = 0.34;
    CLI::App app("A model by its voxels and by its triangles");
    app.add_option("model", settings.model)->required();
    app.add_option("views", settings.views)->required();
    app.add_option("pose", settings.pose)->required();
    app.add_option("--material", settings.material);
    app.add_option("--poses", settings.poses);
    app.add_option("--first", settings.first);
    app.add_option("--blur", settings.blur_mm);
    app.add_option("--sigma", settings.sigma_px);
    CLI11_PARSE(app, argc, argv);
    measure(settings, record);
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    return run_program("raylign_triangles", [&] { return run(argc, argv); });
}
