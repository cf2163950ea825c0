#include "raylign/study.h"

#include <cmath>
#include <numbers>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/random.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kFarthestMm = 1000;
constexpr double kMostIntervals = 1000;

template <typename Get>
Percentiles over(std::span<const TrialOutcome> trials, Get get) {
    std::vector<double> values;
    values.reserve(trials.size());
    for (const TrialOutcome& trial : trials) values.push_back(get(trial));
    return percentiles(values);
}

}  // namespace

std::vector<StudyInterval> study_intervals(const StudyBins& bins) {
    const std::string text =
        number_text(bins.low_mm) + ":" + number_text(bins.step_mm) + ":" + number_text(bins.high_mm);
    const bool ordered = bins.low_mm >= 0 && bins.low_mm < bins.high_mm && bins.high_mm <= kFarthestMm;
    if (!ordered || !(bins.step_mm > 0 && (bins.high_mm - bins.low_mm) / bins.step_mm <= kMostIntervals)) {
        throw bad_value("bins", text, "LOW:STEP:HIGH with 0 <= LOW < HIGH <= 1000 mm and 1 to 1000 intervals");
    }
    std::vector<StudyInterval> intervals;
    // The edges by multiplication: adding 0.1 ten times is not 1. A sliver left by rounding is no interval.
    for (int i = 0;; ++i) {
        const double low_mm = bins.low_mm + i * bins.step_mm;
        if (low_mm >= bins.high_mm - 1e-9 * bins.step_mm) return intervals;
        const double next_mm = bins.low_mm + (i + 1) * bins.step_mm;
        const bool last = next_mm >= bins.high_mm - 1e-9 * bins.step_mm;
        intervals.push_back({low_mm, last ? bins.high_mm : next_mm});
    }
}

std::uint64_t study_seed(std::uint64_t seed, std::size_t interval, std::size_t repetition) {
    // Through the generator once per number: neighbouring seeds, intervals and repetitions share nothing.
    const std::uint64_t with_interval = Random(seed).bits() + interval;
    const std::uint64_t with_repetition = Random(with_interval).bits() + repetition;
    return Random(with_repetition).bits();
}

StudyStart study_start(const StudyInterval& interval, std::size_t interval_number, std::size_t repetition,
                       std::uint64_t seed, const RigidTransform& true_world_from_ct,
                       std::span<const Eigen::Vector3d> targets_ct_mm) {
    StudyStart start{interval_number, repetition, study_seed(seed, interval_number, repetition), 0, {}};
    Random random(start.seed);
    start.initial_mtre_mm = random.uniform(interval.low_mm, interval.high_mm);
    start.world_from_ct = perturbed_start(true_world_from_ct, targets_ct_mm, start.initial_mtre_mm, random.bits());
    return start;
}

ErrorSplit split_error(const RigidTransform& found_world_from_ct, const RigidTransform& true_world_from_ct,
                       std::span<const Eigen::Vector3d> targets_ct_mm, const ViewGeometry& view) {
    const Eigen::Vector3d centre_ct = targets_centre_mm(targets_ct_mm);
    const Eigen::Vector3d true_world = true_world_from_ct * centre_ct;
    const Eigen::Vector3d shift_world = found_world_from_ct * centre_ct - true_world;
    const Eigen::Vector3d ray = (true_world - source_world_mm(view)).normalized();
    const double along_mm = shift_world.dot(ray);
    return {.in_plane_mm = (shift_world - along_mm * ray).norm(),
            .depth_mm = std::abs(along_mm),
            .rotation_rad = rotation_angle_rad(found_world_from_ct * inverse(true_world_from_ct))};
}

SuccessCriterion success_criterion(const VoxelGrid& grid, std::size_t views) {
    if (views == 1) return {1, true};
    return {grid.spacing_mm.minCoeff() / 2, false};
}

StudySummary summarise(std::span<const TrialOutcome> trials) {
    StudySummary summary;
    std::size_t successes = 0, expected = 0, within = 0;
    for (const TrialOutcome& trial : trials) {
        if (trial.verdict_ok && trial.expected_error_mm) {
            ++expected;
            within += trial.final_mtre_mm < 2 * *trial.expected_error_mm ? 1 : 0;
        }
        successes += trial.success ? 1 : 0;
        summary.undetected_failures += !trial.success && trial.verdict_ok ? 1 : 0;
        summary.false_alarms += trial.success && !trial.verdict_ok ? 1 : 0;
    }
    constexpr double kDegPerRad = 180 / std::numbers::pi;
    summary.success = wilson_interval(successes, trials.size());
    if (expected > 0) summary.within_twice_expected = wilson_interval(within, expected);
    summary.mtre_mm = over(trials, [](const TrialOutcome& t) { return t.final_mtre_mm; });
    summary.mrpd_mm = over(trials, [](const TrialOutcome& t) { return t.final_mrpd_mm; });
    summary.in_plane_mm = over(trials, [](const TrialOutcome& t) { return t.split.in_plane_mm; });
    summary.depth_mm = over(trials, [](const TrialOutcome& t) { return t.split.depth_mm; });
    summary.rotation_deg = over(trials, [](const TrialOutcome& t) { return kDegPerRad * t.split.rotation_rad; });
    summary.time_s = over(trials, [](const TrialOutcome& t) { return t.time_s; });
    summary.evaluations = over(trials, [](const TrialOutcome& t) { return t.evaluations; });
    summary.linearizations = over(trials, [](const TrialOutcome& t) { return t.linearizations; });
    return summary;
}

std::vector<IntervalSuccess> successes_per_interval(std::span<const StudyInterval> intervals,
                                                    std::span<const TrialOutcome> trials) {
    std::vector<IntervalSuccess> list;
    for (const StudyInterval& interval : intervals) list.push_back({interval.low_mm, interval.high_mm, 0, 0});
    for (const TrialOutcome& trial : trials) {
        IntervalSuccess& of_trial = list.at(trial.interval);
        ++of_trial.trials;
        of_trial.successes += trial.success ? 1 : 0;
    }
    return list;
}

}  // namespace raylign
