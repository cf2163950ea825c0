#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace raylign {

/// Costs of many points at once: the batch is the unit that engines are fast at.
using BatchObjective = std::function<void(std::span<const Eigen::VectorXd> points, std::span<double> costs)>;

enum class Termination {
    converged,        ///< no step longer than the tolerance lowers the cost
    max_iterations,
    non_finite_cost,  ///< the objective gave NaN or infinity
    stopped,          ///< the caller's callback said so
};
[[nodiscard]] std::string_view termination_name(Termination termination);

/// Lengths are in the units of the (scaled, unitless) parameters.
struct SteepestDescentOptions {
    double difference_step = 0.1;   ///< h of the central differences, positive
    double initial_step = 1;        ///< first length tried by the line search, positive
    double max_step = 10;           ///< longest step, at least initial_step
    double step_tolerance = 1e-3;   ///< stop below this step length, positive
    int max_iterations = 100;       ///< in [1, 10000]

    /// The first fault in words, or empty.
    [[nodiscard]] std::string problem() const;
};

struct SteepestDescentStep {
    int iteration = 0;  ///< from 1
    double cost = 0;
    double length = 0;
    const Eigen::VectorXd& point;
};

struct SteepestDescentResult {
    Eigen::VectorXd point;
    double cost = 0;
    int iterations = 0;
    Termination termination = Termination::converged;
};

/// Minimises from `start`: [Ino06] section 2.3. Each iteration evaluates all central differences in ONE batch of 2 n points,
/// then a line search in batches of five lengths, refined by a parabola. The direction is -g scaled by the curvatures that the
/// same 2 n values give for free (g_i / max(|f_ii|, 1/100 of the largest)), so that weak directions (depth of a single view)
/// move as well as strong ones: derived here, it departs from the paper's plain -g.
/// `on_step` is called after each accepted step; false stops.
[[nodiscard]] SteepestDescentResult steepest_descent(const BatchObjective& objective, const Eigen::VectorXd& start,
                                                     const SteepestDescentOptions& options,
                                                     const std::function<bool(const SteepestDescentStep&)>& on_step = {});

}  // namespace raylign
