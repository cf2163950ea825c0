#pragma once

#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

namespace raylign::detail::test {

/// A ForEach with a thread for each turn, begun from the last to the first.
inline void all_at_once(std::size_t count, const std::function<void(std::size_t)>& turn) {
    std::vector<std::jthread> threads;
    for (std::size_t i = count; i-- > 0;) threads.emplace_back([&turn, i] { turn(i); });
}

}  // namespace raylign::detail::test
