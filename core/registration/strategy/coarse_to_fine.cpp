#include "core/registration/strategy/coarse_to_fine.h"

#include <algorithm>
#include <cmath>

#include "core/registration/strategy/finish.h"

namespace raylign::detail {
namespace {

constexpr double kFineFilterShare = 0.25;
constexpr double kLeastSigma_px = 0.5;

}  // namespace

GradientFilter given_filter(const Run& run) { return run.options.similarity.filter; }

GradientFilter fine_filter(const Run& run) {
    GradientFilter filter = given_filter(run);
    filter.sigma_px = std::max(kLeastSigma_px, filter.sigma_px * kFineFilterShare);
    filter.radius_px = std::max(2, static_cast<int>(std::ceil(3 * filter.sigma_px)));
    return filter;
}

std::vector<LevelPlan> plan_run(Run& run, Content content, std::ptrdiff_t left_out) {
    const GradientFilter filter = content == Content::part ? fine_filter(run) : given_filter(run);
    std::vector<LevelPlan> levels =
        plan_levels(run.volume(), run.views, run.start, run.extent, filter, run.options.levels);
    levels.erase(levels.begin(), levels.begin() + std::min(left_out, std::ssize(levels) - 1));
    run.total_work = run.done_work;
    for (const LevelPlan& level : levels) run.total_work += level_work(level);
    run.level_count = static_cast<int>(run.result.levels.size() + levels.size());
    return levels;
}

void coarse_to_fine(Run& run, Content content, const std::vector<LevelPlan>& levels,
                    const std::function<std::optional<Focus>()>& focus,
                    const std::function<Next(Level&, const LevelPlace&)>& step) {
    std::unique_ptr<Level> level, coarser;
    const auto close_all = [&] {
        if (coarser) coarser->close();
        if (level) level->close();
    };
    try {
        for (std::size_t i = 0; i < levels.size(); ++i) {
            level = std::make_unique<Level>(run, levels[i], content, focus());
            const LevelPlace place{i == 0, i + 2 == levels.size(), i + 1 == levels.size()};
            const Next next = step(*level, place);
            run.done_work += level_work(levels[i]);
            if (next == Next::finely) finish_finely(run, levels[i], levels[i + 1]);
            if (next != Next::finer) break;
            if (place.is_last) finish_as_it_needs(run, *level, coarser.get());
            if (coarser) coarser->close();
            coarser = std::move(level);
        }
    } catch (...) {
        close_all();
        throw;
    }
    close_all();
}

}  // namespace raylign::detail
