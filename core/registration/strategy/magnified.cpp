#include "core/registration/strategy/magnified.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/registration/policy.h"
#include "core/registration/strategy/candidates.h"
#include "core/registration/strategy/domain.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/trust/magnification.h"
#include "core/registration/trust/pose_sums.h"

namespace raylign::detail {
namespace {

constexpr std::array kMagnifications{0.88, 0.94, 1.06, 1.13};
constexpr double kPoorCost_scale = 0.15;  // right poses of phantoms had 0.08, an sdd 7 % wrong 0.2 and more
constexpr double kFarBetter = 0.75;       // times the cost

std::vector<View> magnified(std::span<const View> views, double by) {
    std::vector<View> result(views.begin(), views.end());
    for (View& view : result) view.geometry.camera.intrinsics_px.topLeftCorner<2, 2>() *= by;
    return result;
}

struct Fit {
    double cost = 1;
    std::optional<Magnification> further;  ///< beyond what the views are magnified by
};

/// The end of a descent from the result in these views.
Fit fit_in(Run& run, std::span<const View> views, const LevelPlan& plan) {
    const RigidTransform pose = run.result.world_from_ct;
    Fit fit;
    on_level_beside(run, views, plan, [&](Run& beside, Level& level) {
        weigh_whole(beside, level, pose);
        LevelProblem problem = level.problem(pose, false);
        problem.max_iterations = std::min(problem.max_iterations, kSearchIterations);
        const std::vector<Candidate> ends = refined(problem, std::vector<Candidate>{{pose, 0, 1}});
        if (ends.empty()) return;
        fit.cost = ends.front().cost;
        const std::vector<ViewSums> sums =
            pose_sums(level.session(), ends.front().world_from_ct, run.extent.centre_ct_mm, problem.before_batch,
                      by_magnification(level.views()));
        fit.further = magnification(sums, shares_of(level.session()), kCalibration_mismatch);
    });
    return fit;
}

bool is_worth_a_look(const Run& run) {
    return run.result.content == Content::whole && run.result.method == Method::gauss_newton &&
           run.options.compare_views && run.views.size() > 1 && run.explained_cost &&
           *run.explained_cost >= kPoorCost_scale;
}

}  // namespace

void look_for_magnification(Run& run) {
    if (!is_worth_a_look(run)) return;
    const LevelPlan plan = plan_levels(run.volume(), run.views, run.result.world_from_ct, run.extent,
                                       run.options.similarity.filter, run.options.levels)
                               .front();
    double least = kFarBetter * fit_in(run, run.views, plan).cost;
    for (const double by : kMagnifications) {
        const Fit fit = fit_in(run, magnified(run.views, by), plan);
        if (!(fit.cost < least) || !fit.further) continue;
        least = fit.cost;
        run.magnification = Magnification{std::log(by) + fit.further->log, fit.further->sigma};
    }
}

}  // namespace raylign::detail
