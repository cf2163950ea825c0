#include "apps/study/trial.h"

#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"

namespace raylign::detail::apps {
namespace {

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
    const std::vector<ViewGeometry> geometry = case_geometry(study, study.cases[record.study_case]);
    const auto errors = [&](const RigidTransform& world_from_ct) {
        return target_errors(world_from_ct, study.true_world_from_ct, study.targets_ct_mm, geometry);
    };
    record.initial_mrpd_mm = errors(start).mean_mrpd_mm;
    const TargetErrors found = errors(record.world_from_ct);
    record.final_mtre_mm = found.mtre_mm;
    record.final_mrpd_mm = found.mean_mrpd_mm;
    record.split = split_error(record.world_from_ct, study.true_world_from_ct, study.targets_ct_mm, geometry.front());
    const SuccessCriterion criterion = success_criterion(study.volume.grid, geometry.size());
    const double error_mm = criterion.by_mrpd ? record.final_mrpd_mm : record.final_mtre_mm;
    record.success = record.error.empty() && error_mm < criterion.limit_mm;
}

}  // namespace

StudyStart start_of_trial(const Study& study, const TrialPlace& place) {
    return study_start(study.intervals[place.interval], place.interval, place.repetition, study.options.method.seed,
                       study.true_world_from_ct, study.targets_ct_mm);
}

TrialRecord run_trial(const Study& study, std::size_t trial, const RunControl& control) {
    const TrialPlace place = trial_place(study, trial);
    const StudyCase& study_case = study.cases[place.study_case];
    const StudyStart start = start_of_trial(study, place);
    TrialRecord record;
    record.trial = trial;
    record.study_case = place.study_case;
    record.interval = place.interval;
    record.repetition = place.repetition;
    record.seed = start.seed;
    record.initial_mtre_mm = start.initial_mtre_mm;
    record.world_from_ct = start.world_from_ct;
    RegistrationOptions options = options_of_case(study, study_case);
    const std::vector<View> views = trial_views(study, study_case, start.seed);
    try {
        take_result(record, register_volume(study.volume, views, start.world_from_ct, options,
                                            *study.backends[place.study_case], control));
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        record.error = error.what();  // a start that misses the detector is a failed trial, not a failed study
    }
    measure(record, study, start.world_from_ct);
    return record;
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
