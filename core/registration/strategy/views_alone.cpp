#include "core/registration/strategy/views_alone.h"

#include <algorithm>

#include "core/base/linear_algebra.h"
#include "core/registration/level/pixel_weights.h"
#include "core/registration/strategy/domain.h"

namespace raylign::detail {
namespace {

constexpr int kAloneSteps = 4;
constexpr double kLongestAlone_px = 8, kAloneSettled_px = 0.05;  // of the object's rim, a step

/// One step of the posterior of the wide prior, about `moved` from the result.
Twist step_alone(const Linearization& at, const Twist& moved, double noise) {
    const Vector6 held = noise * wide_prior_precision();
    const Matrix6 curvature = at.curvature + Matrix6(held.asDiagonal());
    return -solve_symmetric(curvature, Vector6(at.gradient + held.cwiseProduct(moved)));
}

double step_mm(const Twist& step, double radius_mm) {
    return step.tail<3>().norm() + radius_mm * step.head<3>().norm();
}

ViewAlone view_alone(Run& run, Session& session, double pixel_mm, double noise) {
    const RigidTransform& result = run.result.world_from_ct;
    const Eigen::Vector3d centre_ct_mm = run.extent.centre_ct_mm, centre_world_mm = result * centre_ct_mm;
    const auto before_batch = [&run] { stop_if_asked(run); };
    PixelWeights weights(session);
    ViewAlone alone;
    const auto pose = [&] { return exp_about(alone.moved, centre_world_mm) * result; };
    for (int i = 0; i < kAloneSteps; ++i) {
        before_batch();
        weights.reweight(pose());
        Linearization at;
        const RigidTransform here = pose();
        session.linearize({&here, 1}, centre_ct_mm, {&at, 1});
        Twist step = step_alone(at, alone.moved, noise);
        const double length_mm = step_mm(step, run.extent.radius_mm);
        if (!step.allFinite()) break;
        step *= std::min(1.0, kLongestAlone_px * pixel_mm / std::max(length_mm, 1e-12));
        alone.moved += step;  // so near the result twists add up
        if (length_mm < kAloneSettled_px * pixel_mm) break;
    }
    alone.sums = pose_sums(session, pose(), centre_ct_mm, before_batch).front();
    return alone;
}

}  // namespace

std::vector<ViewAlone> views_alone(Run& run, Level& level, std::span<const ViewEvidence> evidence) {
    if (!std::ranges::all_of(evidence, &ViewEvidence::is_estimated)) return {};
    weigh_whole_evenly(run, level, run.result.world_from_ct);
    const LevelPlan& plan = level.plan();
    std::vector<ViewAlone> alone;
    for (std::size_t v = 0; v < level.views().size(); ++v) {
        const auto session = run.resident.session(plan.volume_halvings, level.views().subspan(v, 1),
                                                  {run.options.similarity.metric, plan.filter});
        session->set_weights({&level.session().fixed_channels(v).weights, 1});
        alone.push_back(view_alone(run, *session, plan.pixel_at_object_mm, evidence[v].noise));
        level.count(*session);
    }
    return alone;
}

}  // namespace raylign::detail
