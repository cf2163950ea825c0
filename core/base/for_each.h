#pragma once

#include <cstddef>
#include <functional>

namespace raylign::detail {

/// Calls turn(i) for every i in [0, count), some at the same time where it has threads, and returns when all are done.
/// Turns must not depend on each other.
using ForEach = std::function<void(std::size_t count, const std::function<void(std::size_t)>& turn)>;

/// The one without threads.
inline void in_order(std::size_t count, const std::function<void(std::size_t)>& turn) {
    for (std::size_t i = 0; i < count; ++i) turn(i);
}

}  // namespace raylign::detail
