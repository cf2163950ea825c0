#pragma once

#include <Eigen/Core>
#include <string>

#include "core/optimize/steepest_descent.h"

namespace raylign::detail {

/// Lengths are in the units of the (scaled, unitless) parameters.
struct BobyqaOptions {
    double initial_step = 1;       ///< radius of the first trust region, positive
    double step_tolerance = 1e-3;  ///< stop when no parameter moves by more, positive
    int max_evaluations = 1000;    ///< in [1, 1000000]

    /// The first fault in words, or empty.
    [[nodiscard]] std::string problem() const;
};

struct BobyqaResult {
    Eigen::VectorXd point;
    double cost = 0;
    int iterations = 0;  ///< evaluations that lowered the cost
    Termination termination = Termination::converged;
};

/// Minimises from `start` without derivatives: BOBYQA, quadratic models by interpolation [Powell09], in NLopt. One
/// point per batch: the method is sequential. `on_step` hears of every evaluation that lowers the cost; its `length` is
/// the distance from the best point before. A cost that is not finite ends it.
[[nodiscard]] BobyqaResult bobyqa(const BatchObjective& objective, const Eigen::VectorXd& start,
                                  const BobyqaOptions& options, const SteepestDescentCallback& on_step = {});

}  // namespace raylign::detail
