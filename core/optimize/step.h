#pragma once

#include <functional>

namespace raylign::detail {

/// What an optimizer tells its caller after each accepted step.
struct OptimizerStep {
    int iteration = 0;  ///< from 1
    double cost = 0;
    double length = 0;  ///< of the step, in parameter units
};
/// Returns false to stop.
using StepCallback = std::function<bool(const OptimizerStep&)>;

}  // namespace raylign::detail
