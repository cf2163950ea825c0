#pragma once

#include "core/registration/level/level.h"

namespace raylign::detail {

/// Notes what this level, with the run's own filter and before robust weights, leaves unexplained: what the verdict
/// looks at. Noise and weights raise the cost of a fine filter.
void explained_on(Run& run, Level& level);

/// Finishes on the finest level, or with a fine filter on it where the volume as a whole leaves something unexplained.
/// `coarser` may be null.
void finish_as_it_needs(Run& run, Level& level, Level* coarser);

/// True where a whole leaves so much unexplained on a level that it is to be finished with a fine filter: scatter,
/// metal and other contrast bias wide gradients (0.7 mm on the chest CT) far more than fine ones (0.1 mm).
[[nodiscard]] bool wants_fine_finish(const Run& run, const Level& level);

/// Fine filter, evened-out gradients, robust weights: on the level before the last first, where a step costs a quarter
/// and the weights settle, then on the last. Leaves the result finished.
void finish_finely(Run& run, const LevelPlan& coarser, const LevelPlan& last);

/// Finishes a part that was followed on this level alone (follow.h): robust weights once, costs, expected error.
void finish_near(Run& run, Level& level);

/// What was found, of a part, is doubted whatever comes: no robust weights, and few iterations (Run::is_hopeless).
void take_for_hopeless(Run& run, bool is_hopeless);

/// True where more than noise is unexplained, so that weights which count it less are worth their time.
[[nodiscard]] bool wants_robust_weights(const Run& run, const Level& level);

}  // namespace raylign::detail
