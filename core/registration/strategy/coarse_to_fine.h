#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/registration/level/level.h"

namespace raylign::detail {

/// The levels of a run as this content, coarsest first but for those left out, with filters that suit it; they count
/// towards the progress.
[[nodiscard]] std::vector<LevelPlan> plan_run(Run& run, Content content, std::ptrdiff_t left_out = 0);

/// The filter of the finest level as given, or a fine one: a quarter as wide. A bone's fine edges are its own, wide
/// ones are not.
[[nodiscard]] GradientFilter given_filter(const Run& run);
[[nodiscard]] GradientFilter fine_filter(const Run& run);

/// Where in the pyramid a level stands.
struct LevelPlace {
    bool is_first = false, is_last_but_one = false, is_last = false;
};

/// Goes through the levels, coarsest first: on each, `focus` says where its images are cut to (nothing: not at all),
/// and `step` moves the result and says how to go on. The result is finished (finish.h) on the last level, or, where
/// the step asks for it, with a fine filter from there on. Two levels are open at a time: the expected error of a
/// whole is taken from the coarser one.
enum class Next {
    finer,   ///< the next level, or the finish after the last
    finely,  ///< the level before the last: the last as finish_finely does it
    end,     ///< finer levels are of no use
};
void coarse_to_fine(Run& run, Content content, const std::vector<LevelPlan>& levels,
                    const std::function<std::optional<Focus>()>& focus,
                    const std::function<Next(Level&, const LevelPlace&)>& step);

}  // namespace raylign::detail
