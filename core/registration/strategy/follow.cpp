#include "core/registration/strategy/follow.h"

#include "core/registration/policy.h"
#include "core/registration/strategy/coarse_to_fine.h"
#include "core/registration/strategy/domain.h"
#include "core/registration/strategy/finish.h"

namespace raylign::detail {
namespace {

LevelPlan level_for(const Run& run, int coarser_by) {
    const std::vector<LevelPlan> levels =
        plan_levels(run.volume(), bare(run.views), run.start, run.extent, fine_filter(run), run.options.levels);
    LevelPlan plan = coarser(levels, coarser_by);
    plan.filter = fine_filter(run);
    return plan;
}

}  // namespace

void follow(Run& run, int coarser_by) {
    RegistrationResult& result = run.result;
    result.method = Method::gauss_newton;
    result.content = Content::part;
    result.world_from_ct = run.start;
    const LevelPlan plan = level_for(run, coarser_by);
    run.total_work = level_work(plan);
    on_level(run, plan, Content::part, Focus{run.start, kDomainMargin_mm}, [&](Level& level) {
        weigh_part(run, level, run.start);  // throws, too, where a view does not show the part at all
        level.settle(false);
        finish_near(run, level);
    });
}

}  // namespace raylign::detail
