#pragma once

#include <string_view>

namespace raylign {

/// Why an optimizer stopped; one set for all methods.
enum class Termination {
    converged,  ///< no step longer than the tolerance lowers the cost
    max_iterations,
    non_finite_cost,  ///< the objective gave NaN or infinity
    stopped,          ///< the caller asked for it
    time_limit,       ///< the time allowed was over
};
[[nodiscard]] std::string_view termination_name(Termination termination);

}  // namespace raylign
