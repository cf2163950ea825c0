#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/shared/manifest.h"
#include "apps/study/options.h"
#include "core/backend.h"
#include "raylign/study.h"

namespace raylign::detail::apps {

/// An object that every trial moves.
struct StudyObject {
    std::string name;
    Volume volume;
    std::vector<Eigen::Vector3d> targets_ct_mm;
};

/// Everything that trials are made from. Trials are numbered from 0: cases innermost, then intervals, then repetitions,
/// so that a study stopped half-way has as many trials of each case and interval.
struct Study {
    StudyOptions options;
    Volume volume;                     ///< with objects what is left of the CT
    std::vector<StudyObject> objects;  ///< of --move
    std::vector<View> views;         ///< of the file; images: the file's, or simulated without noise (ideal) of volume
    std::vector<char> is_simulated;  ///< per view
    std::string simulation;          ///< how, in words; "" where no view is simulated
    XrayModel xray;
    std::vector<XrayExposure> exposures;  ///< of the simulated views, in order; empty for the ideal X-ray model
    RigidTransform true_world_from_ct;
    std::vector<Eigen::Vector3d> targets_ct_mm;
    std::optional<Eigen::Vector3d> rotation_centre_ct_mm;
    std::vector<StudyInterval> intervals;
    std::vector<StudyCase> cases;
    std::vector<std::unique_ptr<Backend>> backends;  ///< per case
    std::vector<LeftOut> left_out;
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files;
    InputHashes hashes;  ///< of the files

    /// Trials that one registration makes: one per object, numbered one after the other.
    [[nodiscard]] std::size_t together() const { return objects.empty() ? 1 : objects.size(); }
    [[nodiscard]] std::size_t trial_count() const { return intervals.size() * cases.size() * options.per_bin; }
};

/// Which trial a number stands for.
struct TrialPlace {
    std::size_t study_case = 0, interval = 0, repetition = 0;
};
[[nodiscard]] TrialPlace trial_place(const Study& study, std::size_t trial);

/// Reads all inputs, makes the backends and simulates the X-rays that the views lack: by the other projector than the
/// registration's (trilinear with steps of 0.4 voxels, or joseph), on the full grid. Throws Error as the parts do.
[[nodiscard]] Study set_up_study(const StudyOptions& settled_options);

/// Where the case's object is among those of the study; none where there are none.
[[nodiscard]] std::optional<std::size_t> object_of(const Study& study, const StudyCase& study_case);
[[nodiscard]] const Volume& volume_of(const Study& study, const StudyCase& study_case);
[[nodiscard]] const std::vector<Eigen::Vector3d>& targets_of(const Study& study, const StudyCase& study_case);
/// Of the case's object in the trial of this seed: moved at random about its centre.
[[nodiscard]] RigidTransform true_pose_of(const Study& study, const StudyCase& study_case, std::uint64_t seed);

/// One view set of a case, its X-rays with objects and noise of this trial.
[[nodiscard]] std::vector<View> trial_views(const Study& study, const StudyCase& study_case, std::uint64_t seed);

/// Geometry of the views that a case uses, in its order.
[[nodiscard]] std::vector<ViewGeometry> case_geometry(const Study& study, const StudyCase& study_case);

}  // namespace raylign::detail::apps
