#include "core/registration/strategy/refine_views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/linear_algebra.h"
#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/domain.h"
#include "core/registration/strategy/finish.h"
#include "core/registration/strategy/joint_views.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/trust/model_error.h"
#include "core/registration/trust/pose_sums.h"
#include "core/registration/trust/view_agreement.h"

namespace raylign::detail {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kJointRounds = 3;  // of robust weights and noise, which both depend on how well cameras fit
constexpr double kJointStep_px = 2e-3, kJointStepCoarse_px = 2e-2;
constexpr double kJointDecrease = 1e-4;  // of F, a negative log likelihood: far below what matters
constexpr double kLongestJointStep_px = 16;
constexpr double kLookPrior_deg = 5, kLookPrior_mm = 30;  // where nobody said how far cameras may be off

/// How one level is used.
struct Stage {
    LevelPlan plan;
    bool is_even = false;    ///< gradients evened out, as finish_as_it_needs does
    bool is_robust = false;  ///< weights renewed
    bool is_last = false;
    double resolved = 0;  ///< what the last level resolves [mm]
};

std::vector<Stage> stages_of(Run& run, const RegistrationResult& found) {
    std::vector<Stage> stages;
    for (const LevelPlan& plan : plan_run(run, found.content)) stages.push_back({plan});
    if (stages.size() > 1) stages.erase(stages.begin());
    const GradientFilter last = found.levels.back().filter;
    const bool is_fine = found.content == Content::whole && last.sigma_px != stages.back().plan.filter.sigma_px;
    if (is_fine) {
        Stage fine = stages.back();
        fine.plan.filter = last;
        fine.is_even = true;
        stages.push_back(fine);
    }
    for (Stage& stage : stages)
        stage.resolved = resolved_mm(stages.back().plan.pixel_at_object_mm, found.levels.back().spacing_mm);
    stages.back().is_last = true;
    stages.back().is_robust = found.robust_rounds > 0;
    run.level_count = static_cast<int>(stages.size());
    return stages;
}

/// The views of a level, each in a session of its own, with the level's weights.
JointProblem joint_problem(Run& run, Level& level, const CameraFreedom& freedom, const JointPose& pose,
                           const Eigen::Vector3d& centre_world_mm) {
    JointProblem problem{.views = {},
                         .prior_rad = freedom.prior_deg / kDegrees,
                         .prior_mm = freedom.prior_mm,
                         .centre_world_mm = centre_world_mm,
                         .radius_mm = run.extent.radius_mm,
                         .before_batch = [&run] { stop_if_asked(run); }};
    const LevelPlan& plan = level.plan();
    for (std::size_t v = 0; v < level.views().size(); ++v) {
        JointView view{.session = run.resident.session(plan.volume_halvings, level.views().subspan(v, 1),
                                                       {run.options.similarity.metric, plan.filter}),
                       .session_moved = pose.moved[v],
                       .share = level.session().view_share(v) * static_cast<double>(level.views().size()),
                       .moves = freedom.moves[v]};
        view.session->set_weights({&level.session().fixed_channels(v).weights, 1});
        problem.views.push_back(std::move(view));
    }
    return problem;
}

/// False where a view says too little.
bool estimate_noise(Run& run, JointProblem& problem, const JointPose& pose, const EvidenceScale& scale) {
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
        JointView& view = problem.views[v];
        const std::vector<ViewSums> sums =
            pose_sums(*view.session, pose_in_session(pose, view, v), run.extent.centre_ct_mm, problem.before_batch);
        const std::vector<ViewEvidence> evidence = view_evidence(sums, scale);
        if (!evidence.front().is_estimated) return false;
        view.noise = evidence.front().noise;
    }
    return true;
}

/// The cost as a Session of all views would have it.
double cost_of(const JointProblem& problem, const JointPose& pose) {
    double cost = 0, shares = 0;
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
        const JointView& view = problem.views[v];
        const RigidTransform seen = pose_in_session(pose, view, v);
        double of_view = 0;
        view.session->evaluate({&seen, 1}, {&of_view, 1});
        cost += view.share * of_view;
        shares += view.share;
    }
    return cost / shares;
}

struct JointOutcome {
    JointPose pose;
    LocalModel model;
    std::vector<Eigen::VectorXd> pulls;  ///< of what a DRR does not model, at the end
};

/// By how much blur, scatter and hardening of each view pull at pose and cameras (model_error.h).
std::vector<Eigen::VectorXd> model_pulls(Run& run, JointProblem& problem, const JointPose& pose) {
    std::vector<Eigen::VectorXd> pulls;
    for (std::size_t v = 0; v < problem.views.size(); ++v) {
        const JointView& view = problem.views[v];
        const std::vector<ViewSums> sums =
            pose_sums(*view.session, pose_in_session(pose, view, v), run.extent.centre_ct_mm, problem.before_batch);
        const std::vector<ModelShift> shifts = model_shifts_of_views(sums).front();
        for (const ModelShift& shift : shifts) {
            pulls.push_back(pull_of_view(problem, pose, v, sums.front().all.curvature, shift.twist));
        }
    }
    return pulls;
}

/// Solves on one level; `outcome` begins where the level before ended. False where the noise is not known.
bool solve_stage(Run& run, const Stage& stage, Level& level, const CameraFreedom& freedom,
                 const Eigen::Vector3d& centre_world_mm, JointOutcome& outcome) {
    const double pixel_mm = stage.plan.pixel_at_object_mm;
    if (level.report().content == Content::part) weigh_part(run, level, outcome.pose.world_from_ct);
    if (stage.is_even) weigh_whole_evenly(run, level, outcome.pose.world_from_ct);
    JointProblem problem = joint_problem(run, level, freedom, outcome.pose, centre_world_mm);
    std::vector<PixelWeights> weights;
    for (JointView& view : problem.views) weights.emplace_back(*view.session);
    level.report().cost_initial = cost_of(problem, outcome.pose);
    const EvidenceScale scale =
        evidence_scale(stage.is_robust ? kCalibration_mismatch : kCalibration_explained, stage.resolved);
    for (int round = 0; round < (stage.is_last ? kJointRounds : 1); ++round) {
        for (std::size_t v = 0; stage.is_robust && v < problem.views.size(); ++v) {
            weights[v].reweight(pose_in_session(outcome.pose, problem.views[v], v));
        }
        if (!estimate_noise(run, problem, outcome.pose, scale)) return false;
        const double tolerance_px = stage.is_last ? kJointStep_px : kJointStepCoarse_px;
        const LevenbergMarquardtResult solved = solve_jointly(problem, outcome.pose,
                                                              {.max_step = kLongestJointStep_px * pixel_mm,
                                                               .step_tolerance = tolerance_px * pixel_mm,
                                                               .decrease_tolerance = kJointDecrease,
                                                               .max_iterations = run.options.max_iterations_per_level});
        outcome.model = solved.model;
        level.report().iterations += solved.iterations;
        level.report().termination = solved.termination;
    }
    if (stage.is_last) outcome.pulls = model_pulls(run, problem, outcome.pose);
    level.report().cost_final = cost_of(problem, outcome.pose);
    for (const JointView& view : problem.views) level.count(*view.session);
    return true;
}

/// The inverse of the model's curvature in rad and mm, widened by where the pulls would have moved pose and cameras.
Eigen::MatrixXd covariance_of(const JointOutcome& outcome, double radius_mm) {
    const LocalModel& model = outcome.model;
    const Eigen::Index n = model.gradient.size();
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        covariance.col(i) = solve_symmetric(model.curvature, Eigen::VectorXd(Eigen::VectorXd::Unit(n, i)));
    }
    Eigen::VectorXd scale = Eigen::VectorXd::Ones(n);
    for (Eigen::Index i = 0; i < n; i += 6) scale.segment<3>(i) /= radius_mm;
    covariance = (scale.asDiagonal() * covariance * scale.asDiagonal()).eval();
    Eigen::MatrixXd widened = covariance;
    for (const Eigen::VectorXd& pull : outcome.pulls) {
        const Eigen::VectorXd moved = kModelCalibration * covariance * pull;
        widened += moved * moved.transpose();
    }
    return widened;
}

RefinedViews refined_of(const Run& run, const RigidTransform& found, const CameraFreedom& freedom,
                        const JointOutcome& outcome, const Eigen::Vector3d& centre_world_mm) {
    RefinedViews refined{.world_from_ct = outcome.pose.world_from_ct, .moved = outcome.pose.moved, .corrections = {}};
    const Eigen::MatrixXd covariance = covariance_of(outcome, run.extent.radius_mm);
    refined.covariance = covariance.topLeftCorner<6, 6>();
    const Twist pose_change = camera_twist(refined.world_from_ct * inverse(found), centre_world_mm);
    Eigen::Index place = 6;
    for (std::size_t v = 0; v < refined.moved.size(); ++v) {
        refined.corrections.emplace_back();
        if (!freedom.moves[v]) continue;
        refined.corrections.back() =
            correction_of(camera_twist(refined.moved[v], centre_world_mm), covariance.block<6, 6>(place, place),
                          pose_change, run.extent.radius_mm);
        refined.corrections.back().centre_world_mm = centre_world_mm;
        place += 6;
    }
    return refined;
}

}  // namespace

std::optional<RefinedViews> refine_views(Run& run, const RegistrationResult& found, const CameraFreedom& freedom) {
    const std::span<const View> as_given = run.views;
    const Eigen::Vector3d centre_world_mm = found.world_from_ct * run.extent.centre_ct_mm;
    JointOutcome outcome{{found.world_from_ct, std::vector<RigidTransform>(as_given.size())}, {}};
    bool is_known = true;
    for (const Stage& stage : stages_of(run, found)) {
        // Parts are cut out, and weighed, where the cameras see them now.
        const std::vector<View> moved = with_moved_cameras(as_given, outcome.pose.moved);
        run.views = moved;
        std::optional<Focus> focus;
        if (found.content == Content::part) focus = Focus{outcome.pose.world_from_ct, kDomainMargin_mm};
        try {
            on_level(run, stage.plan, found.content, focus, [&](Level& level) {
                is_known = solve_stage(run, stage, level, freedom, centre_world_mm, outcome);
            });
        } catch (...) {
            run.views = as_given;
            throw;
        }
        run.views = as_given;
        if (!is_known) return std::nullopt;
    }
    return refined_of(run, found.world_from_ct, freedom, outcome, centre_world_mm);
}

std::vector<View> with_moved_cameras(std::span<const View> views, std::span<const RigidTransform> moved) {
    std::vector<View> result(views.begin(), views.end());
    for (std::size_t v = 0; v < result.size(); ++v) {
        RigidTransform& camera_from_world = result[v].geometry.camera_from_world;
        camera_from_world = camera_from_world * inverse(moved[v]);
    }
    return result;
}

void look_closer(const Run& run, RegistrationResult& result) {
    const std::optional<std::size_t> suspect = suspected_view(result);
    if (!suspect) return;
    CameraFreedom freedom{std::vector<bool>(run.views.size(), false), kLookPrior_deg, kLookPrior_mm};
    freedom.moves[*suspect] = true;
    Run closer{run.resident, run.views, run.options, run.control, run.extent, result.world_from_ct};
    closer.result.method = result.method;
    closer.shows_the_cut = run.shows_the_cut;
    closer.begin = run.begin;  // the time limit is the run's
    const std::optional<RefinedViews> refined = refine_views(closer, result, freedom);
    add_work(result, closer.result);
    if (!refined) return;
    // One step from the pose is judged with all that moves edges; what is found with the camera free, by its size.
    ViewCorrection& correction = result.views[*suspect].correction;
    const double significance = correction.significance;
    correction = refined->corrections[*suspect];
    correction.significance = std::min(correction.significance, significance);
}

void add_work(RegistrationResult& sum, const RegistrationResult& other) {
    add(sum.counters, other.counters);
    add(sum.timing, other.timing);
}

}  // namespace raylign::detail
