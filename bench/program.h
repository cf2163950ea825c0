#pragma once

#include <cstdio>
#include <ctime>
#include <exception>

#include "core/base/error.h"

namespace raylign::detail::bench {

/// What main() returns: what `work` returns, or, with a line of what is wrong, 2; 3 where something is not there.
template <class Work>
[[nodiscard]] int run_program(const char* name, const Work& work) {
    try {
        return work();
    } catch (const Error& error) {
        std::fprintf(stderr, "%s: %s\n", name, error.what());
        return error.kind() == ErrorKind::unavailable ? 3 : 2;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s: %s\n", name, error.what());
        return 2;
    }
}

/// Of all threads of this process, since it began.
[[nodiscard]] inline double processor_s() {
    timespec time{};
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace raylign::detail::bench
