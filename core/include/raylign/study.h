#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "raylign/statistics.h"
#include "raylign/targets.h"

namespace raylign {

/// Intervals of the initial mTRE: [low, low + step), ... up to high, the last one cut off there.
struct StudyBins {
    double low_mm = 0, step_mm = 2, high_mm = 20;
};
/// Starts with low_mm <= mTRE < high_mm.
struct StudyInterval {
    double low_mm = 0, high_mm = 0;
};
/// Throws Error unless 0 <= low < high <= 1000 and the step makes 1 to 1000 intervals.
[[nodiscard]] std::vector<StudyInterval> study_intervals(const StudyBins& bins);

/// One random start. Depends on the study's seed, the interval's and the repetition's number only, so that all cases of
/// a study (views, backends, methods) begin at the same poses and any one can be made again alone.
struct StudyStart {
    std::size_t interval = 0, repetition = 0;
    std::uint64_t seed = 0;
    double initial_mtre_mm = 0;  ///< uniform in the interval
    RigidTransform world_from_ct;
};
[[nodiscard]] std::uint64_t study_seed(std::uint64_t seed, std::size_t interval, std::size_t repetition);
[[nodiscard]] StudyStart study_start(const StudyInterval& interval, std::size_t interval_number, std::size_t repetition,
                                     std::uint64_t seed, const RigidTransform& true_world_from_ct,
                                     std::span<const Eigen::Vector3d> targets_ct_mm);

/// Where an error lies, as seen by one view: how far the targets' centre is displaced across and along the ray through
/// its true place, and the angle of the rotation between the two poses.
struct ErrorSplit {
    double in_plane_mm = 0;
    double depth_mm = 0;  ///< not negative
    double rotation_rad = 0;
};
/// Throws Error for no targets.
[[nodiscard]] ErrorSplit split_error(const RigidTransform& found_world_from_ct,
                                     const RigidTransform& true_world_from_ct,
                                     std::span<const Eigen::Vector3d> targets_ct_mm, const ViewGeometry& view);

/// What counts as found: mTRE below half a voxel side [Ino06]; with one view, which hardly sees depth, mRPD below 1 mm.
struct SuccessCriterion {
    double limit_mm = 0;
    bool by_mrpd = false;
};
[[nodiscard]] SuccessCriterion success_criterion(const VoxelGrid& grid, std::size_t views);

/// The numbers of one registration that statistics are made of.
struct TrialOutcome {
    std::size_t interval = 0;
    double final_mtre_mm = 0, final_mrpd_mm = 0;
    ErrorSplit split;
    bool success = false;
    bool verdict_ok = false;                  ///< what the program said, not knowing the truth
    std::optional<double> expected_error_mm;  ///< 1 sigma, where one was given
    double time_s = 0, evaluations = 0, linearizations = 0;
};

/// Percentiles over all trials, failures included.
struct StudySummary {
    Proportion success;
    Percentiles mtre_mm, mrpd_mm, in_plane_mm, depth_mm, rotation_deg, time_s, evaluations, linearizations;
    std::size_t undetected_failures = 0;  ///< failed, yet the verdict was ok
    std::size_t false_alarms = 0;         ///< succeeded, yet the verdict was doubtful
    /// Of the trials with an ok verdict and an expected error: those whose mTRE is below twice of it.
    Proportion within_twice_expected;
};
[[nodiscard]] StudySummary summarise(std::span<const TrialOutcome> trials);

/// Successes per interval: what capture_range_mm takes.
[[nodiscard]] std::vector<IntervalSuccess> successes_per_interval(std::span<const StudyInterval> intervals,
                                                                  std::span<const TrialOutcome> trials);

}  // namespace raylign
