#include "apps/study/setup.h"

#include <algorithm>
#include <functional>

#include "apps/shared/append.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/simulated_views.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/random.h"
#include "core/image/composed.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/simulate.h"

namespace raylign::detail::apps {
namespace {

constexpr std::uint64_t kSeedOfObject = 0xD1B54A32D192ED03u;  // far apart: objects move independently

void read_small_files(Study& study) {
    const TruthFlags& options = study.options.truth;
    study.true_world_from_ct = read_pose(options.truth);
    study.files.push_back(options.truth);
    if (!options.targets.empty()) {
        study.targets_ct_mm = read_targets(options.targets);
        study.rotation_centre_ct_mm = targets_centre_mm(study.targets_ct_mm);
        study.files.push_back(options.targets);
    }
    ViewsFile views = read_views(study.options.views, ReadImages::if_named);
    study.views = std::move(views.views);
    append(study.files, views.files);
    append(study.notes, views.notes);
}

void make_cases(Study& study) {
    std::vector<std::string> names;
    for (const View& view : study.views) names.push_back(view.name);
    std::vector<std::string> objects{""};
    if (!study.options.articulation.moves.empty()) objects.clear();
    for (const StudyObject& object : study.objects) objects.push_back(object.name);
    study.cases = study_cases(study.options, names, objects, study.left_out);
    for (const StudyCase& study_case : study.cases) {
        const BackendFlags flags = with_backend(study.options.backend, study_case.backend);
        study.backends.push_back(choose_backend(flags).backend);
    }
}

/// Cuts the CT into the objects that move, and the rest.
void cut_objects_of(Study& study) {
    const StudyOptions& options = study.options;
    if (options.articulation.moves.empty()) return;
    for (const View& view : study.views) {
        if (view.image.empty()) continue;
        throw Error("--move simulates all X-rays, and view " + view.name + " of " + options.views.string() +
                    " has an image: leave it out");
    }
    LabelledObjects cut = cut_moving(options.articulation, options.volume, study.volume);
    append(study.files, cut.files);
    append(study.notes, cut.notes);
    for (std::size_t k = 0; k < cut.names.size(); ++k) {
        std::vector<Eigen::Vector3d> targets = default_targets_ct_mm(cut.objects[k]);
        study.objects.push_back({cut.names[k], std::move(cut.objects[k]), std::move(targets)});
    }
    study.volume = std::move(*cut.rest);
}

void simulate(Study& study) {
    const Projector projector = projector_from_name(study.options.backend.projector);
    if (study.options.detector.is_ideal()) {
        const SimulatedViews simulated =
            simulate_missing_images(study.volume, study.views, study.true_world_from_ct, projector);
        study.is_simulated = simulated.is_simulated;
        study.simulation = simulated.how;
        return;
    }
    std::vector<View> missing;
    for (const View& view : study.views) {
        study.is_simulated.push_back(view.image.empty() ? 1 : 0);
        if (view.image.empty()) missing.push_back(view);
    }
    if (missing.empty()) {
        throw Error("--xray " + study.options.detector.xray + " has no meaning here: every view of " +
                    study.options.views.string() + " has an image, and none is simulated");
    }
    if (study.objects.empty()) {
        study.exposures = exposures(study.xray, study.options.detector, study.volume, study.options.volume, missing,
                                    study.true_world_from_ct, projector);
    }
    study.simulation = "X-ray model " + study.options.detector.xray + ", projector " +
                       (projector == Projector::joseph ? "trilinear, steps of 0.4 voxels" : "joseph") +
                       ", full grid of the CT, 2x2 samples a pixel";
}

/// Adds what the objects show where they are in this trial, as the rest's image was made.
void add_objects(const Study& study, std::uint64_t seed, View& view) {
    const Projector projector = projector_from_name(study.options.backend.projector);
    for (const StudyObject& object : study.objects) {
        std::vector<View> bare{view};
        bare.front().image = {};
        const RigidTransform pose = true_pose_of(study, {.object = object.name}, seed);
        (void)simulate_missing_images(object.volume, bare, pose, projector);
        std::ranges::transform(view.image.pixels, bare.front().image.pixels, view.image.pixels.begin(), std::plus<>());
    }
}

/// The X-ray model's exposure of the rest with the objects where they are in this trial, resampled into its grid.
XrayExposure exposure_with_objects(const Study& study, std::size_t v, std::uint64_t seed) {
    Volume whole = study.volume;
    for (const StudyObject& object : study.objects) {
        const RigidTransform pose = true_pose_of(study, {.object = object.name}, seed);
        add_resampled(whole, study.true_world_from_ct, object.volume, pose);
    }
    return exposures(study.xray, study.options.detector, whole, study.options.volume, {study.views[v]},
                     study.true_world_from_ct, projector_from_name(study.options.backend.projector))
        .front();
}

/// The view's X-ray with the objects of trial `of` and the noise of this seed.
void expose_view(const Study& study, std::size_t v, std::uint64_t of, std::uint64_t seed, View& view) {
    const double photons = study.options.detector.noise_photons.value_or(0);
    if (!study.options.detector.is_ideal() && !study.objects.empty()) {
        read_counts(view, detected(study.xray, exposure_with_objects(study, v, of), seed));
        return;
    }
    if (!study.objects.empty()) add_objects(study, of, view);
    if (!study.options.detector.is_ideal()) {
        const auto simulated_before = std::count(study.is_simulated.begin(), study.is_simulated.begin() + v, 1);
        read_counts(view, detected(study.xray, study.exposures[simulated_before], seed));
    } else if (photons > 0) {
        view.image = with_photon_noise(view.image, photons, seed);
    }
}

}  // namespace

TrialPlace trial_place(const Study& study, std::size_t trial) {
    const std::size_t cases = study.cases.size(), intervals = study.intervals.size();
    return {trial % cases, trial / cases % intervals, trial / cases / intervals};
}

Study set_up_study(const StudyOptions& settled_options) {
    Study study;
    study.options = settled_options;
    study.intervals = study_intervals(parse_bins(study.options.bins));
    (void)render_settings(study.options.backend);  // checks names first: that is cheap
    study.xray = detector_model(study.options.detector);
    if (!study.options.detector.spectrum.empty()) study.files.push_back(study.options.detector.spectrum);
    read_small_files(study);
    if (study.options.articulation.moves.empty()) make_cases(study);
    stop_if_interrupted();
    VolumeFlags flags = study.options.volume;
    if (!study.options.articulation.moves.empty()) flags.labels = flags.label_table = "";
    VolumeFile volume =
        read_object_volume(flags, study.views, [&](const VoxelGrid&) { return read_pose(study.options.truth.truth); });
    study.true_world_from_ct = read_pose(study.options.truth.truth, volume.files.front());
    study.volume = std::move(volume.volume);
    append(study.files, volume.files);
    append(study.notes, volume.notes);
    cut_objects_of(study);
    if (!study.objects.empty()) make_cases(study);
    study.hashes = hash_inputs(study.files);
    stop_if_interrupted();
    if (study.targets_ct_mm.empty()) study.targets_ct_mm = default_targets_ct_mm(study.volume);
    simulate(study);
    if (!study.objects.empty()) {
        const MotionLimits limits = motion_limits(study.options.articulation);
        study.simulation += ", objects moved by up to " + number_text(limits.mm) + " mm and " +
                            number_text(limits.deg) + " degrees per axis";
    }
    return study;
}

std::optional<std::size_t> object_of(const Study& study, const StudyCase& study_case) {
    const auto found = std::ranges::find(study.objects, study_case.object, &StudyObject::name);
    if (found == study.objects.end()) return std::nullopt;
    return static_cast<std::size_t>(found - study.objects.begin());
}

const Volume& volume_of(const Study& study, const StudyCase& study_case) {
    const std::optional<std::size_t> object = object_of(study, study_case);
    return object ? study.objects[*object].volume : study.volume;
}

const std::vector<Eigen::Vector3d>& targets_of(const Study& study, const StudyCase& study_case) {
    const std::optional<std::size_t> object = object_of(study, study_case);
    return object ? study.objects[*object].targets_ct_mm : study.targets_ct_mm;
}

RigidTransform true_pose_of(const Study& study, const StudyCase& study_case, std::uint64_t seed) {
    const std::optional<std::size_t> object = object_of(study, study_case);
    if (!object) return study.true_world_from_ct;
    Random random(seed + kSeedOfObject * (*object + 1));
    const Eigen::Vector3d centre_ct_mm = targets_centre_mm(study.objects[*object].targets_ct_mm);
    return random_motion(motion_limits(study.options.articulation), study.true_world_from_ct * centre_ct_mm, random) *
           study.true_world_from_ct;
}

std::vector<View> trial_views(const Study& study, const StudyCase& study_case, std::uint64_t seed) {
    std::vector<View> views;
    for (const std::string& name : study_case.views) {
        for (std::size_t v = 0; v < study.views.size(); ++v) {
            if (study.views[v].name != name) continue;
            views.push_back(study.views[v]);
            // The seed follows the view's place in the file: it has the same noise in every case.
            if (study.is_simulated[v] != 0) expose_view(study, v, seed, Random(seed + v + 1).bits(), views.back());
        }
    }
    return views;
}

std::vector<ViewGeometry> case_geometry(const Study& study, const StudyCase& study_case) {
    std::vector<ViewGeometry> geometry;
    for (const std::string& name : study_case.views) {
        for (const View& view : study.views) {
            if (view.name == name) geometry.push_back(view.geometry);
        }
    }
    return geometry;
}

}  // namespace raylign::detail::apps
