#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "raylign/options.h"
#include "raylign/termination.h"

namespace raylign {

/// One accepted step of the optimizer.
struct IterationRecord {
    int level = 0;  ///< 0 = coarsest
    int iteration = 0;
    double cost = 0;
    double step_mm = 0;  ///< how far the step moved the object's rim
    RigidTransform world_from_ct;
};

/// One resolution of a run.
struct LevelReport {
    Eigen::Vector3i volume_size = Eigen::Vector3i::Zero();
    Eigen::Vector3d spacing_mm = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector2i> image_sizes_px;
    GradientFilter filter;
    Content content = Content::whole;
    double cost_initial = 0, cost_final = 0;
    int iterations = 0;
    std::uint64_t evaluations = 0, linearizations = 0;
    bool restarted = false;        ///< the start's cost was lower than that of the coarser level's result
    std::size_t volume_bytes = 0;  ///< the backend's own copies
    std::string volume_layout;     ///< how it keeps them (Session::volume_layout)
    double time_s = 0;
    Termination termination = Termination::converged;
};

/// Another pose that explains the X-rays nearly as well.
struct Rival {
    RigidTransform world_from_ct;
    double cost = 0;          ///< under the weights that the result was chosen by, like SearchReport::cost
    double shift_mm = 0;      ///< of the object's centre from the result's
    double rotation_deg = 0;  ///< from the result
};

/// What a search tried and found.
struct SearchReport {
    Search mode = Search::none;  ///< what ran; never automatic
    double range_mm = 0;         ///< near: how far from the start was looked
    std::int64_t starts = 0;     ///< poses tried
    int refined = 0;             ///< of these, refined
    int agreeing = 0;            ///< refined ones that ended at the result
    double cost = 0;             ///< of the result where the finalists were compared
    std::vector<Rival> rivals;   ///< distinct other ends, best first
};

/// How sure the pose is: from how far it moves when parts of the images are left out, and from how far blur, scatter
/// and beam hardening, which a DRR has not, would have moved it.
struct Confidence {
    bool is_estimated = false;  ///< all else but is_withheld is zero if not
    bool is_withheld = false;   ///< the verdict doubts the pose: how sure a wrong pose is nobody needs to know
    /// Of the twist (rad, mm) about the object's centre in world.
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    double translation_mm = 0;  ///< root of the trace of the translation's covariance
    double rotation_deg = 0;    ///< root of the trace of the rotation's covariance
    double rim_mm = 0;          ///< root mean square shift of points of the object: what mTRE to expect
    Eigen::Vector3d weakest_direction = Eigen::Vector3d::Zero();  ///< of translation, in world; unit
    double weakest_mm = 0;                                        ///< sigma along it
    Eigen::Vector3d weakest_axis = Eigen::Vector3d::Zero();       ///< of rotation, in world; unit
    double weakest_deg = 0;                                       ///< sigma about it
    /// Where there is one view only: rim_mm along its line of sight to the object and without that; zero otherwise.
    double in_depth_mm = 0, in_plane_mm = 0;
};

/// How a view's camera would have to be moved for its image to fit best where the other views see the object; with
/// RegistrationOptions::refine_views how it was moved. The camera's twist in world about the object's centre at the
/// pose: camera_from_world is followed, from the right, by the inverse of T(c) exp(rotation, translation) T(-c). Only
/// relative corrections can be seen: those of two views are about opposite.
struct ViewCorrection {
    bool is_estimated = false;                               ///< all else is zero if not
    bool is_applied = false;                                 ///< the pose is that with the corrected camera
    Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();  ///< rotation vector about world axes
    Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
    Eigen::Vector3d centre_world_mm = Eigen::Vector3d::Zero();  ///< the point that it is about
    Eigen::Vector3d rotation_sigma_deg = Eigen::Vector3d::Zero(), translation_sigma_mm = Eigen::Vector3d::Zero();
    /// How unlikely the correction is between right cameras: the root of its squared length in standard deviations, per
    /// degree of freedom. About 1 between views that agree.
    double significance = 0;
    /// What it would make of the pose: the object's twist (rad, mm) about its centre in world, and the root mean square
    /// shift of its points.
    Eigen::Matrix<double, 6, 1> pose_change = Eigen::Matrix<double, 6, 1>::Zero();
    double effect_mm = 0;
    bool is_doubtful = false;  ///< the verdict counts it: larger than chance explains, and it matters for the pose
};

/// One view of a result.
struct ViewResult {
    ViewCorrection correction;
    RigidTransform camera_from_world;  ///< what the pose is told with: the view's own, corrected where that was asked
};

/// The pose, whether to believe it, and how it came about.
struct RegistrationResult {
    RigidTransform world_from_ct;
    RigidTransform start_world_from_ct;
    Eigen::Vector3d rotation_centre_ct_mm =
        Eigen::Vector3d::Zero();  ///< what the pose is turned about: the object's centre
    /// Of the finest level; stopped and time_limit: the best pose until then.
    Termination termination = Termination::converged;
    Metric metric = Metric::gc;
    Method method = Method::steepest_descent;  ///< what ran; never automatic
    std::string method_reason;                 ///< why, if it was chosen
    Content content = Content::whole;          ///< what it was registered as; never automatic
    std::vector<std::string> decisions;        ///< what the driver chose and why, in order
    /// Finest level, final weights: of the start and of the result. NaN where time was up before; the result's may then
    /// be that of a coarser level.
    double cost_initial = std::numeric_limits<double>::quiet_NaN(), cost_final = cost_initial;
    /// Of the result, per view: of a whole with the run's own filter, before a finer one and robust weights finish it.
    std::vector<double> view_costs;
    std::vector<double> fine_view_costs;  ///< the same with the filter and weights that it was finished with
    std::vector<ViewResult> views;        ///< as given
    std::vector<double> overlap;          ///< share of the object that each view shows on usable pixels, [0, 1]
    std::vector<double> covered;          ///< share of each view's image that the box around the object fills
    std::vector<LevelReport> levels;      ///< coarsest first
    std::vector<IterationRecord> history;
    int iterations = 0;
    int robust_rounds = 0;  ///< how often robust weights were renewed
    SearchReport search;
    Confidence confidence;
    SessionCounters counters;  ///< summed over levels
    SessionTiming timing;      ///< summed over levels
    double optimizer_s = 0;    ///< wall time outside prepare and the backend
    double total_s = 0;
    bool ok = false;                   ///< the verdict
    std::vector<std::string> reasons;  ///< why not, in words for people; empty if ok
};

/// One line: "ok: cost 0.2108 -> 0.0123, expected error 0.042 mm, 17 iterations, 0.31 s".
[[nodiscard]] std::string brief(const RegistrationResult& result);

/// What there is to know, a line each, with a line feed at the end: verdict and reasons, how far the object moved and
/// turned, cost, expected error, search, decisions, time.
[[nodiscard]] std::string full(const RegistrationResult& result);

}  // namespace raylign
