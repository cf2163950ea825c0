// How far a model in one X-ray with known truth is off, and what it was expected to be off:
//   raylign_implant MODEL VIEWS POSE [--material M] [--poses N] [--first N] [--blur MM,...] [--floor SHARE] [--bits N]
//                   [--tissue L] [--photons N] [--spacing PX] [--line-integrals] [--threads N] [--json FILE]
//                   [--clip SHARE] [--black SHARE] [--write FOLDER]
// VIEWS has the camera (and an image, whose pixels do not count), POSE is where truth is near. X-rays: the exact length
// of each ray inside the triangles (exact_lengths.h) on 3 x 3 samples a pixel, exp(-mu length) times what tissue of
// random soft lumps lets through, the detector's blur, quanta, a floor and whole counts. Truth: within 10 mm and 10
// degrees of POSE; the start within 2 mm and 2 degrees of truth, without search: one minimum is what is measured.
// --clip raises all smaller counts to this share of the largest, --black takes it off all: metal is flat to the count.
// --write leaves views_N.json, N.tif, truth_N.json and start_N.json (within 10 mm and 10 degrees) for `raylign
// register` instead.

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "bench/implant_xray.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/random.h"
#include "core/io/images/counts.h"
#include "core/io/meshes/material.h"
#include "core/io/meshes/mesh_file.h"
#include "raylign/backends.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "raylign/registration.h"

namespace raylign::detail::bench {
namespace {

struct Settings : ImplantXray {
    std::string model, views, pose, material = "cobalt-chrome";
    std::string folder;  ///< to write to, instead of registering
    int poses = 20, first = 0, threads = 1;
    std::vector<double> blurs_mm{0.34};
    double spacing_px = 2.0 / 3;
    bool line_integrals = false;  ///< compared by these, as before
    bool voxels = false;          ///< DRRs from these, not from the triangles
};

struct Outcome {
    double depth_mm = 0, plane_mm = 0, turn_deg = 0;
    double expected_depth_mm = 0, expected_plane_mm = 0, expected_deg = 0;
    bool ok = false;
};

Outcome outcome_of(const RegistrationResult& found, const RigidTransform& truth, const Eigen::Vector3d& centre_ct_mm,
                   const ViewGeometry& view) {
    const Eigen::Vector3d at_mm = truth * centre_ct_mm, off_mm = found.world_from_ct * centre_ct_mm - at_mm;
    const Eigen::Vector3d axis = (at_mm - source_world_mm(view)).normalized();
    Outcome outcome;
    outcome.depth_mm = off_mm.dot(axis);
    outcome.plane_mm = (off_mm - outcome.depth_mm * axis).norm();
    outcome.turn_deg = Eigen::AngleAxisd(found.world_from_ct.rotation * truth.rotation.transpose()).angle() / kDegree;
    outcome.expected_depth_mm = found.confidence.in_depth_mm;
    outcome.expected_plane_mm = found.confidence.in_plane_mm;
    outcome.expected_deg = found.confidence.rotation_deg;
    outcome.ok = found.ok;
    return outcome;
}

/// A case for the program.
void write_case(const Settings& settings, const TriangleMesh& mesh, double mu_per_mm, const View& view,
                const RigidTransform& near, int seed) {
    const Eigen::Vector3d centre_ct_mm = (bounds_of(mesh).low_mm + bounds_of(mesh).high_mm) / 2;
    Random random(static_cast<std::uint64_t>(seed));
    const RigidTransform truth = moved(near, near * centre_ct_mm, 10, 10, random);
    const std::filesystem::path folder = settings.folder;
    const std::string name = std::to_string(seed);
    std::filesystem::create_directories(folder);
    const RawXray counts = counts_of(mesh, mu_per_mm, view.geometry, truth, settings, seed);
    write_counts(folder / (name + ".tif"), counts.image, counts.max_representable);
    write_views(folder / ("views_" + name + ".json"), {view}, {name + ".tif"}, counts_read_as());
    write_pose(folder / ("truth_" + name + ".json"), truth);
    write_pose(folder / ("start_" + name + ".json"), moved(truth, truth * centre_ct_mm, 10, 10, random));
}

Outcome run_pose(const Settings& settings, const TriangleMesh& mesh, const Volume& volume, double mu_per_mm, View view,
                 const RigidTransform& near, int seed, Backend& backend) {
    const Eigen::Vector3d centre_ct_mm = (bounds_of(mesh).low_mm + bounds_of(mesh).high_mm) / 2;
    Random random(static_cast<std::uint64_t>(seed));
    const RigidTransform truth = moved(near, near * centre_ct_mm, 10, 10, random);
    const RigidTransform start = moved(truth, truth * centre_ct_mm, 2, 2, random);
    view = shown_on(mesh, mu_per_mm, view, truth, settings, seed);
    view.by_transmission = !settings.line_integrals;
    RegistrationOptions options;
    options.content = Content::part;
    options.search.mode = Search::none;
    const std::vector<View> views{view};
    const RegistrationResult found = register_volume(volume, views, start, options, backend);
    const Outcome outcome = outcome_of(found, truth, centre_ct_mm, view.geometry);
    std::cout << "pose " << seed << ": depth " << outcome.depth_mm << " (expected " << outcome.expected_depth_mm
              << "), in plane " << outcome.plane_mm << " (" << outcome.expected_plane_mm << ") mm, turn "
              << outcome.turn_deg << " (" << outcome.expected_deg << ") degrees, ceiling " << view.ceiling << ", cost "
              << found.cost_final << (found.ok ? ", ok" : ", doubtful: " + found.reasons.front()) << std::endl;
    return outcome;
}

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return std::nan("");
    std::ranges::sort(values);
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

/// Shares of the poses whose error is below twice the expected one, and the table's row.
void report(const Settings& settings, const std::vector<Outcome>& outcomes, Record& record) {
    std::vector<double> depth, size, expected, plane, turn;
    int told = 0, depth_covered = 0, plane_covered = 0, turn_covered = 0, ok = 0;
    double sum = 0, squares = 0;
    for (const Outcome& o : outcomes) {
        depth.push_back(o.depth_mm);
        size.push_back(std::abs(o.depth_mm));
        plane.push_back(o.plane_mm);
        turn.push_back(o.turn_deg);
        sum += o.depth_mm;
        squares += o.depth_mm * o.depth_mm;
        ok += o.ok ? 1 : 0;
        if (!(o.expected_depth_mm > 0)) continue;
        ++told;
        expected.push_back(o.expected_depth_mm);
        depth_covered += std::abs(o.depth_mm) < 2 * o.expected_depth_mm ? 1 : 0;
        plane_covered += o.plane_mm < 2 * o.expected_plane_mm ? 1 : 0;
        turn_covered += o.turn_deg < 2 * o.expected_deg ? 1 : 0;
    }
    const auto count = static_cast<double>(outcomes.size());
    std::cout << "depth: mean " << sum / count << ", rms " << std::sqrt(squares / count) << ", p50 of the size "
              << quantile(size, 0.5) << ", most " << quantile(size, 1) << " mm; expected p50 "
              << quantile(expected, 0.5) << " (" << quantile(expected, 0) << " to " << quantile(expected, 1)
              << "); below twice that: depth " << depth_covered << ", in plane " << plane_covered << ", turn "
              << turn_covered << " of " << told << "; ok " << ok << " of " << count << "; in plane p50 "
              << quantile(plane, 0.5) << " mm, turn p50 " << quantile(turn, 0.5) << " degrees" << std::endl;
    const std::string name = settings.model.substr(settings.model.find_last_of('/') + 1);
    record.add({name, settings.line_integrals ? "line integrals" : "what arrives",
                settings.voxels ? "voxels" : "triangles", settings.blur_mm, settings.floor_share, settings.spacing_px,
                count, sum / count, std::sqrt(squares / count), quantile(size, 1), quantile(expected, 0.5), told,
                depth_covered, plane_covered, turn_covered});
}

void measure(const Settings& settings, Record& record) {
    const TriangleMesh mesh = solid_of(read_mesh(settings.model), settings.model).mesh;
    View view = read_views(std::vector<std::string>{settings.views}, ReadImages::required).views.front();
    const RigidTransform pose = read_pose(settings.pose);
    const MeshBounds bounds = bounds_of(mesh);
    const Eigen::Vector3d middle_mm = pose * Eigen::Vector3d((bounds.low_mm + bounds.high_mm) / 2);
    const double depth_mm = (view.geometry.camera_from_world * middle_mm).z();
    const double pixel_mm = depth_mm / view.geometry.camera.intrinsics_px(0, 0);
    const double mu_per_mm = attenuation_of_material(settings.material, hu_presets().front());
    const Volume volume = read_volume(settings.model, {.material = settings.material,
                                                       .mesh_spacing_mm = settings.spacing_px * pixel_mm,
                                                       .keeps_surface = !settings.voxels})
                              .volume;
    BackendOptions options;
    options.cpu.threads = settings.threads;
    const auto backend = create_backend("cpu", options).backend;
    Settings one = settings;
    for (const double blur_mm : settings.blurs_mm) {
        one.blur_mm = blur_mm;
        std::vector<Outcome> outcomes;
        for (int i = 0; i < settings.poses; ++i) {
            if (!settings.folder.empty()) {
                write_case(one, mesh, mu_per_mm, view, pose, settings.first + i);
                continue;
            }
            outcomes.push_back(run_pose(one, mesh, volume, mu_per_mm, view, pose, settings.first + i, *backend));
        }
        if (!outcomes.empty()) report(one, outcomes, record);
    }
}

void add_options(CLI::App& app, Settings& settings) {
    app.add_option("model", settings.model)->required();
    app.add_option("views", settings.views)->required();
    app.add_option("pose", settings.pose)->required();
    app.add_option("--material", settings.material);
    app.add_option("--poses", settings.poses);
    app.add_option("--first", settings.first);
    app.add_option("--blur", settings.blurs_mm)->delimiter(',');
    app.add_option("--floor", settings.floor_share);
    app.add_option("--clip", settings.clip);
    app.add_option("--black", settings.black);
    app.add_option("--write", settings.folder);
    app.add_option("--bits", settings.bits);
    app.add_option("--tissue", settings.tissue);
    app.add_option("--photons", settings.photons_per_mm2);
    app.add_option("--spacing", settings.spacing_px);
    app.add_option("--threads", settings.threads);
    app.add_flag("--line-integrals", settings.line_integrals);
    app.add_flag("--voxels", settings.voxels);
}

int run(int argc, char** argv) {
    Record record(argc, argv, "Depth of a model in one X-ray",
                  {"model", "compared", "DRR by", "blur [mm]", "floor", "voxels [px]", "poses", "depth, mean [mm]",
                   "depth, rms [mm]", "depth, most [mm]", "expected depth error, p50 [mm]", "told",
                   "depth within twice", "in plane", "turn"});
    Settings settings;
    CLI::App app("Depth of a model in one X-ray");
    add_options(app, settings);
    CLI11_PARSE(app, argc, argv);
    measure(settings, record);
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    using namespace raylign::detail::bench;
    return run_program("raylign_implant", [&] { return run(argc, argv); });
}
