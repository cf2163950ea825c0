#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <future>
#include <vector>

namespace raylign::detail::gl {

/// Calls turn(i) for every i in [0, count) on at most `most` threads, the caller's among them. They are begun and ended
/// in each loop, some 10 us a thread beside milliseconds of work: a pool would have to be kept, and to be shared by
/// sessions.
inline void on_threads(int most, std::size_t count, const std::function<void(std::size_t)>& turn) {
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
        for (std::size_t i = next++; i < count; i = next++) turn(i);
    };
    const std::size_t threads = std::min<std::size_t>(count, static_cast<std::size_t>(most));
    std::vector<std::future<void>> others;  // wait for their ends, also where a turn throws
    for (std::size_t i = 1; i < threads; ++i) others.push_back(std::async(std::launch::async, work));
    work();
    for (std::future<void>& other : others) other.get();
}

}  // namespace raylign::detail::gl
