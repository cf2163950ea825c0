#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "backends/gl/api.h"

namespace raylign::detail::bench {

struct Calls {
    std::string name;
    std::int64_t count = 0;
};

/// `api` with counters before its functions, one set for the whole process.
[[nodiscard]] gl::Api counted(gl::Api api);
/// Those that were called since reset_calls, most often called first.
[[nodiscard]] std::vector<Calls> calls();
[[nodiscard]] std::int64_t calls_of(std::string_view name);
[[nodiscard]] std::int64_t all_calls();
void reset_calls();

}  // namespace raylign::detail::bench
