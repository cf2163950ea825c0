#include "apps/study/trial.h"

#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/registration/scene/scene.h"

namespace raylign::detail::apps {
namespace {

constexpr std::uint64_t kSeedOfStart = 0x9E3779B97F4A7C15u;  // far apart: objects start off independently

RegistrationOptions options_of_case(const Study& study, const StudyCase& study_case) {
    MethodFlags method = study.options.method;
    method.name = study_case.method;
    method.metric = study_case.metric;
    RegistrationOptions registration = registration_options(method, {}, study.options.backend);
    registration.rotation_centre_ct_mm = study.rotation_centre_ct_mm;
    return registration;
}

void take_result(TrialRecord& record, const RegistrationResult& result) {
    record.verdict_ok = result.ok;
    if (result.confidence.is_estimated) record.expected_error_mm = result.confidence.rim_mm;
    record.reasons = joined(result.reasons, "; ");
    record.cost_initial = result.cost_initial;
    record.cost_final = result.cost_final;
    record.iterations = static_cast<std::uint64_t>(result.iterations);
    record.evaluations = result.counters.evaluations;
    record.linearizations = result.counters.linearizations;
    record.bytes_to_host = result.counters.bytes_to_host;
    record.world_from_ct = result.world_from_ct;
    record.total_s = result.total_s;
    record.prepare_s = result.timing.prepare_s;
    record.drr_s = result.timing.drr_s;
    record.gradient_s = result.timing.gradient_s;
    record.reduction_s = result.timing.reduction_s;
    record.transfer_s = result.timing.transfer_s;
    record.optimizer_s = result.optimizer_s;
}

void measure(TrialRecord& record, const Study& study, const RigidTransform& start) {
    const StudyCase& study_case = study.cases[record.study_case];
    const std::vector<ViewGeometry> geometry = case_geometry(study, study_case);
    const std::vector<Eigen::Vector3d>& targets = targets_of(study, study_case);
    const RigidTransform truth = true_pose_of(study, study_case, record.seed);
    const auto errors = [&](const RigidTransform& world_from_ct) {
        return target_errors(world_from_ct, truth, targets, geometry);
    };
    record.initial_mrpd_mm = errors(start).mean_mrpd_mm;
    const TargetErrors found = errors(record.world_from_ct);
    record.final_mtre_mm = found.mtre_mm;
    record.final_mrpd_mm = found.mean_mrpd_mm;
    record.split = split_error(record.world_from_ct, truth, targets, geometry.front());
    const SuccessCriterion criterion = success_criterion(study.volume.grid, geometry.size());
    const double error_mm = criterion.by_mrpd ? record.final_mrpd_mm : record.final_mtre_mm;
    record.success = record.error.empty() && error_mm < criterion.limit_mm;
}

TrialRecord record_of(const Study& study, std::size_t trial) {
    const TrialPlace place = trial_place(study, trial);
    const StudyStart start = start_of_trial(study, place);
    TrialRecord record;
    record.trial = trial;
    record.study_case = place.study_case;
    record.interval = place.interval;
    record.repetition = place.repetition;
    record.seed = start.seed;
    record.initial_mtre_mm = start.initial_mtre_mm;
    record.world_from_ct = start.world_from_ct;
    return record;
}

void run_one(const Study& study, TrialRecord& record, const std::vector<View>& views, const RunControl& control) {
    const StudyCase& study_case = study.cases[record.study_case];
    take_result(record, register_volume(study.volume, views, record.world_from_ct, options_of_case(study, study_case),
                                        *study.backends[record.study_case], control));
}

/// All objects and, where it is asked for, the rest, which stays where it is or begins off as the first object does.
void run_together(const Study& study, std::vector<TrialRecord>& records, const std::vector<View>& views,
                  const RunControl& control) {
    const std::size_t first_case = records.front().study_case;
    std::vector<SceneObject> objects;
    for (std::size_t k = 0; k < records.size(); ++k) {
        objects.push_back({study.objects[k].name, study.objects[k].volume, records[k].world_from_ct});
    }
    const std::string& rest = study.options.rest;
    if (rest == "still") {
        objects.push_back({"rest", study.volume, study.true_world_from_ct, Mobility::stays, true});
    } else if (rest == "body") {
        const RigidTransform truth = true_pose_of(study, study.cases[first_case], records.front().seed);
        const RigidTransform off = records.front().world_from_ct * inverse(truth);
        objects.push_back({"rest", study.volume, off * study.true_world_from_ct, Mobility::moves, true});
    }
    const SceneResult result = register_scene(objects, views, options_of_case(study, study.cases[first_case]),
                                              *study.backends[first_case], control);
    for (std::size_t k = 0; k < records.size(); ++k) {
        take_result(records[k], result.objects[k]);
        records[k].total_s = result.total_s;
    }
}

}  // namespace

StudyStart start_of_trial(const Study& study, const TrialPlace& place) {
    const StudyCase& study_case = study.cases[place.study_case];
    const std::uint64_t seed = study.options.method.seed;
    const std::uint64_t common = study_seed(seed, place.interval, place.repetition);
    StudyStart start = study_start(study.intervals[place.interval], place.interval, place.repetition,
                                   seed + kSeedOfStart * object_of(study, study_case).value_or(0),
                                   true_pose_of(study, study_case, common), targets_of(study, study_case));
    start.seed = common;
    return start;
}

std::vector<TrialRecord> run_trial(const Study& study, std::size_t trial, const RunControl& control) {
    const std::size_t first = trial - trial_place(study, trial).study_case % study.together();
    std::vector<TrialRecord> records;
    for (std::size_t k = 0; k < study.together(); ++k) records.push_back(record_of(study, first + k));
    std::vector<RigidTransform> starts;
    for (const TrialRecord& record : records) starts.push_back(record.world_from_ct);
    const std::vector<View> views = trial_views(study, study.cases[records.front().study_case], records.front().seed);
    try {
        if (study.objects.empty()) {
            run_one(study, records.front(), views, control);
        } else {
            run_together(study, records, views, control);
        }
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        // A start that misses the detector is a failed trial, not a failed study.
        for (TrialRecord& record : records) record.error = error.what();
    }
    for (std::size_t k = 0; k < records.size(); ++k) measure(records[k], study, starts[k]);
    return records;
}

TrialOutcome outcome_of(const TrialRecord& record) {
    return {.interval = record.interval,
            .final_mtre_mm = record.final_mtre_mm,
            .final_mrpd_mm = record.final_mrpd_mm,
            .split = record.split,
            .success = record.success,
            .verdict_ok = record.verdict_ok,
            .expected_error_mm =
                std::isnan(record.expected_error_mm) ? std::nullopt : std::optional<double>(record.expected_error_mm),
            .time_s = record.total_s,
            .evaluations = static_cast<double>(record.evaluations),
            .linearizations = static_cast<double>(record.linearizations)};
}

}  // namespace raylign::detail::apps
