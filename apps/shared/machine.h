#pragma once

#include <cstddef>
#include <string>

namespace raylign::detail::apps {

/// What a report says of the machine that made it.
struct Machine {
    std::string host, processor, system, compiler;
    int cores = 0;  ///< that this process may use
    std::size_t memory_bytes = 0;
};
[[nodiscard]] Machine this_machine();

/// Most memory that this process has had so far, 0 where the system does not say.
[[nodiscard]] std::size_t peak_memory_bytes();

}  // namespace raylign::detail::apps
