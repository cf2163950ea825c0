#include "raylign/termination.h"

namespace raylign {

std::string_view termination_name(Termination termination) {
    switch (termination) {
        case Termination::converged:
            return "converged";
        case Termination::max_iterations:
            return "max-iterations";
        case Termination::non_finite_cost:
            return "non-finite-cost";
        case Termination::stopped:
            return "stopped";
        case Termination::time_limit:
            return "time-limit";
    }
    return "unknown";
}

}  // namespace raylign
