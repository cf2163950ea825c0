#include "apps/study/setup.h"

#include "apps/shared/append.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/simulated_views.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/simulate.h"

namespace raylign::detail::apps {
namespace {

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
    study.cases = study_cases(study.options, names, study.left_out);
    for (const StudyCase& study_case : study.cases) {
        const BackendFlags flags = with_backend(study.options.backend, study_case.backend);
        study.backends.push_back(choose_backend(flags).backend);
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
    read_small_files(study);
    make_cases(study);
    stop_if_interrupted();
    VolumeFile volume = read_volume(study.options.volume.file, volume_read_options(study.options.volume));
    study.true_world_from_ct = read_pose(study.options.truth.truth, volume.files.front());
    study.volume = std::move(volume.volume);
    append(study.files, volume.files);
    append(study.notes, volume.notes);
    study.hashes = hash_inputs(study.files);
    stop_if_interrupted();
    if (study.targets_ct_mm.empty()) study.targets_ct_mm = default_targets_ct_mm(study.volume);
    const SimulatedViews simulated = simulate_missing_images(study.volume, study.views, study.true_world_from_ct,
                                                             projector_from_name(study.options.backend.projector));
    study.is_simulated = simulated.is_simulated;
    study.simulation = simulated.how;
    return study;
}

std::vector<View> trial_views(const Study& study, const StudyCase& study_case, std::uint64_t seed) {
    std::vector<View> views;
    for (const std::string& name : study_case.views) {
        for (std::size_t v = 0; v < study.views.size(); ++v) {
            if (study.views[v].name != name) continue;
            views.push_back(study.views[v]);
            if (study.is_simulated[v] == 0 || study.options.noise_photons == 0) continue;
            // The seed follows the view's place in the file: it has the same noise in every case.
            views.back().image =
                with_photon_noise(views.back().image, study.options.noise_photons, Random(seed + v + 1).bits());
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
