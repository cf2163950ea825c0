#include "apps/study/report.h"

#include <algorithm>

#include "apps/shared/manifest.h"
#include "core/io/files/output.h"
#include "core/io/files/text.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

Json json_of(const StudyCase& study_case) {
    Json json = {{"views", study_case.views},
                 {"backend", study_case.backend},
                 {"method", study_case.method},
                 {"metric", study_case.metric}};
    if (!study_case.object.empty()) json["object"] = study_case.object;
    return json;
}

Json json_of(const Percentiles& p) {
    return {{"p50", p.p50}, {"p75", p.p75}, {"p95", p.p95}, {"p99", p.p99}, {"max", p.max}};
}

Json json_of(const StudySummary& summary) {
    return {{"trials", summary.success.trials},
            {"successes", summary.success.successes},
            {"success_rate", summary.success.rate},
            {"success_low", summary.success.low},
            {"success_high", summary.success.high},
            {"mtre_mm", json_of(summary.mtre_mm)},
            {"mrpd_mm", json_of(summary.mrpd_mm)},
            {"in_plane_mm", json_of(summary.in_plane_mm)},
            {"depth_mm", json_of(summary.depth_mm)},
            {"rotation_deg", json_of(summary.rotation_deg)},
            {"time_s", json_of(summary.time_s)},
            {"evaluations", json_of(summary.evaluations)},
            {"linearizations", json_of(summary.linearizations)},
            {"undetected_failures", summary.undetected_failures},
            {"false_alarms", summary.false_alarms},
            {"expected_error",
             {{"trials", summary.within_twice_expected.trials},
              {"within_twice", summary.within_twice_expected.successes},
              {"rate", summary.within_twice_expected.rate},
              {"low", summary.within_twice_expected.low},
              {"high", summary.within_twice_expected.high}}}};
}

Json mean_stage_times(const std::vector<const TrialRecord*>& records) {
    TrialRecord sum;
    for (const TrialRecord* r : records) {
        sum.prepare_s += r->prepare_s;
        sum.drr_s += r->drr_s;
        sum.gradient_s += r->gradient_s;
        sum.reduction_s += r->reduction_s;
        sum.transfer_s += r->transfer_s;
        sum.optimizer_s += r->optimizer_s;
        sum.total_s += r->total_s;
    }
    const double n = std::max<double>(1, static_cast<double>(records.size()));
    return {{"prepare", sum.prepare_s / n},     {"drr", sum.drr_s / n},           {"gradient", sum.gradient_s / n},
            {"reduction", sum.reduction_s / n}, {"transfer", sum.transfer_s / n}, {"optimizer", sum.optimizer_s / n},
            {"total", sum.total_s / n}};
}

Json case_json(const Study& study, const StudyJournal& journal, std::size_t c) {
    const std::vector<TrialOutcome> outcomes = outcomes_of_case(journal, c);
    Json json = json_of(study.cases[c]);
    const SuccessCriterion criterion = success_criterion(study.volume.grid, study.cases[c].views.size());
    json["label"] = case_label(study.cases[c]);
    json["success_means"] = {{"error", criterion.by_mrpd ? "mRPD" : "mTRE"}, {"below_mm", criterion.limit_mm}};
    json["capture_range_mm"] = capture_range_mm(successes_per_interval(study.intervals, outcomes));
    json["overall"] = json_of(summarise(outcomes));
    json["mean_time_s"] = mean_stage_times(records_of_case(journal, c));
    json["errors"] = std::ranges::count_if(records_of_case(journal, c), [](auto* r) { return !r->error.empty(); });
    json["intervals"] = Json::array();
    for (std::size_t i = 0; i < study.intervals.size(); ++i) {
        std::vector<TrialOutcome> inside;
        std::ranges::copy_if(outcomes, std::back_inserter(inside), [i](auto& t) { return t.interval == i; });
        Json of_interval = {{"low_mm", study.intervals[i].low_mm}, {"high_mm", study.intervals[i].high_mm}};
        if (!inside.empty()) of_interval.update(json_of(summarise(inside)));
        json["intervals"].push_back(of_interval);
    }
    return json;
}

/// Cases that differ in the backend only: how far apart they end from the same starts.
Json agreement(const Study& study, const StudyJournal& journal) {
    Json list = Json::array();
    for (std::size_t b = 1; b < study.cases.size(); ++b) {
        const StudyCase& other = study.cases[b];
        const auto first = std::ranges::find_if(study.cases, [&](const StudyCase& c) {
            return c.views == other.views && c.method == other.method && c.metric == other.metric &&
                   c.object == other.object;
        });
        const auto a = static_cast<std::size_t>(first - study.cases.begin());
        if (a == b) continue;
        std::vector<double> apart_mm;
        std::size_t differ = 0;
        for (const TrialRecord* record : records_of_case(journal, b)) {
            const auto twin = journal.trials().find(record->trial - b + a);
            if (twin == journal.trials().end()) continue;
            apart_mm.push_back(
                mean_target_error_mm(record->world_from_ct, twin->second.world_from_ct, targets_of(study, other)));
            differ += record->success != twin->second.success ? 1 : 0;
        }
        if (apart_mm.empty()) continue;
        list.push_back({{"first", case_label(study.cases[a])},
                        {"second", case_label(other)},
                        {"trials", apart_mm.size()},
                        {"poses_apart_mm", json_of(percentiles(apart_mm))},
                        {"one_succeeds_other_fails", differ}});
    }
    return list;
}

/// Numbers as numbers, names as texts.
Json labels_json(const std::vector<std::string>& labels) {
    Json list = Json::array();
    for (const std::string& label : labels) {
        const std::optional<double> number = number_from(label);
        list.push_back(number ? Json(static_cast<std::int64_t>(*number)) : Json(label));
    }
    return list;
}

/// Everything but the inputs' bytes and the cases that decides a trial's result.
Json settings(const Study& study) {
    const StudyOptions& options = study.options;
    Json json = {{"preset", options.preset},
                 {"bins", options.bins},
                 {"per_bin", options.per_bin},
                 {"xray", options.detector.xray},
                 {"noise_photons", or_null(options.detector.noise_photons)},
                 {"seed", options.method.seed},
                 {"projector", options.backend.projector},
                 {"step_mm", options.backend.step_mm},
                 {"storage", options.backend.storage},
                 {"levels", options.method.levels},
                 {"max_iterations", options.method.max_iterations},
                 {"hu_preset", options.volume.hu_preset},
                 {"hu_offset", options.volume.hu_offset},
                 {"attenuation", options.volume.attenuation},
                 {"spacing", options.volume.spacing},
                 {"label", labels_json(options.volume.label)},
                 {"object", options.volume.object},
                 {"bone_threshold", or_null(options.volume.bone_threshold)},
                 {"clip", or_null(options.volume.clip)},
                 {"interpolation", options.backend.interpolation},
                 {"solver", options.backend.solver},
                 {"crop", options.backend.crop},
                 {"slices", options.backend.slices},
                 {"reduction", options.backend.reduction},
                 {"readback", options.backend.readback}};
    if (!study.objects.empty()) {
        const MotionLimits limits = motion_limits(options.articulation);
        json["move"] = labels_json(options.articulation.moves);
        json["by"] = {{"shift_mm", limits.mm}, {"turn_deg", limits.deg}};
        json["rest"] = options.rest.empty() ? "none" : options.rest;
    }
    return json;
}

}  // namespace

std::string study_config(const Study& study) {
    Json config = {{"version", RAYLIGN_VERSION}};
    config.update(settings(study));
    config.erase("preset");  // what it stands for counts
    config["cases"] = Json::array();
    for (std::size_t c = 0; c < study.cases.size(); ++c) {
        const BackendInfo info = study.backends[c]->info();
        Json of_case = json_of(study.cases[c]);
        // Backends give the same bits on every processor that runs the same instructions.
        of_case["kernels"] = info.instruction_set.empty() ? info.device : info.instruction_set;
        config["cases"].push_back(of_case);
    }
    config["inputs"] = Json::array();
    for (const HashedFile& file : study.hashes.files) config["inputs"].push_back(file.sha256);
    return one_line(config);
}

std::string study_run_note(const Invocation& invocation, int processes) {
    Json note = machine_json();
    note["command"] = invocation.command_line;
    note["processes"] = processes;
    return one_line(note);
}

std::string study_json(const Study& study, const StudyJournal& journal, const Invocation& invocation) {
    Json report = {{"raylign", RAYLIGN_VERSION}, {"command", invocation.command_line}};
    report["settings"] = settings(study);
    report["simulation"] = study.simulation;
    report["xray_model"] = xray_model_json(study.xray);
    report["simulated_views"] = Json::array();
    for (std::size_t v = 0; v < study.views.size(); ++v) {
        if (study.is_simulated[v] != 0) report["simulated_views"].push_back(study.views[v].name);
    }
    std::size_t targets = study.objects.empty() ? study.targets_ct_mm.size() : 0;
    for (const StudyObject& object : study.objects) targets += object.targets_ct_mm.size();
    report["targets"] = targets;
    report["true_world_from_ct"] = matrix_json(study.true_world_from_ct);
    report["cases"] = Json::array();
    for (std::size_t c = 0; c < study.cases.size(); ++c) report["cases"].push_back(case_json(study, journal, c));
    report["agreement"] = agreement(study, journal);
    report["left_out"] = Json::array();
    for (const LeftOut& left_out : study.left_out) {
        report["left_out"].push_back({{"backend", left_out.name}, {"reason", left_out.reason}});
    }
    report["notes"] = study.notes;
    report["inputs"] = inputs_json(study.hashes);
    report["backends"] = Json::array();
    for (std::size_t c = 0; c < study.cases.size(); ++c) {
        Json info = backend_json(study.backends[c]->info());
        if (std::ranges::find(report["backends"], info) == report["backends"].end()) {
            report["backends"].push_back(std::move(info));
        }
    }
    report["runs"] = Json::array();
    for (const std::string& run : journal.runs()) report["runs"].push_back(Json::parse(run));
    return indented(report);
}

std::string study_starts_json(const Study& study) {
    Json list = Json::array();
    for (std::size_t t = 0; t < study.trial_count(); ++t) {
        const TrialPlace place = trial_place(study, t);
        if (place.study_case >= study.together()) continue;  // begins where one before it does
        const StudyStart start = start_of_trial(study, place);
        list.push_back({{"first_trial", t},
                        {"interval", place.interval},
                        {"repetition", place.repetition},
                        {"seed", start.seed},
                        {"initial_mtre_mm", start.initial_mtre_mm},
                        {"world_from_ct", matrix_json(start.world_from_ct)}});
        if (study.objects.empty()) continue;
        const StudyCase& study_case = study.cases[place.study_case];
        list.back()["object"] = study_case.object;
        list.back()["true_world_from_ct"] = matrix_json(true_pose_of(study, study_case, start.seed));
    }
    return indented({{"raylign", RAYLIGN_VERSION}, {"cases", study.cases.size()}, {"starts", list}}, 1);
}

std::string trials_json(const StudyJournal& journal) {
    Json list = Json::array();
    for (const auto& [number, r] : journal.trials()) {
        list.push_back({{"trial", number},
                        {"case", r.study_case},
                        {"initial_mtre_mm", r.initial_mtre_mm},
                        {"final_mtre_mm", r.final_mtre_mm},
                        {"success", r.success},
                        {"verdict_ok", r.verdict_ok},
                        {"expected_error_mm", r.expected_error_mm},
                        {"reasons", r.reasons},
                        {"error", r.error}});
    }
    return one_line(list);
}

}  // namespace raylign::detail::apps
