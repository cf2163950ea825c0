#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>

#include "core/optimize/step.h"
#include "raylign/termination.h"

namespace raylign::detail {

/// Costs of many points at once: the batch is the unit that backends are fast at.
using BatchObjective = std::function<void(std::span<const Eigen::VectorXd> points, std::span<double> costs)>;

/// Lengths are in the units of the (scaled, unitless) parameters.
struct SteepestDescentOptions {
    double difference_step = 0.1;  ///< h of the central differences, positive
    double initial_step = 1;       ///< first length tried by the line search, positive
    double max_step = 10;          ///< longest step, at least initial_step
    double step_tolerance = 1e-3;  ///< stop below this step length, positive
    int max_iterations = 100;      ///< in [1, 10000]

    /// The first fault in words, or empty.
    [[nodiscard]] std::string problem() const;
};

struct SteepestDescentResult {
    Eigen::VectorXd point;
    double cost = 0;
    int iterations = 0;
    Termination termination = Termination::converged;
};

/// Called after each accepted step with its point; returns false to stop.
using SteepestDescentCallback = std::function<bool(const OptimizerStep&, const Eigen::VectorXd& point)>;

/// Minimises from `start`: [Ino06] section 2.3. Each iteration evaluates all central differences in ONE batch of 2 n
/// points, then a line search in batches of five lengths, refined by a parabola. The direction is -g scaled by the
/// curvatures that the same 2 n values give for free (g_i / max(|f_ii|, 1/100 of the largest)), so that weak directions
/// (depth of a single view) move as well as strong ones: derived here, it departs from the paper's plain -g.
[[nodiscard]] SteepestDescentResult steepest_descent(const BatchObjective& objective, const Eigen::VectorXd& start,
                                                     const SteepestDescentOptions& options,
                                                     const SteepestDescentCallback& on_step = {});

}  // namespace raylign::detail
