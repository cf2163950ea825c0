#pragma once

#include <chrono>

namespace raylign::detail {

/// Of all times that are told: no setting of the computer's clock moves it.
using Clock = std::chrono::steady_clock;

[[nodiscard]] inline double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace raylign::detail
