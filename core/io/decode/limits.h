#pragma once

#include <cstddef>
#include <filesystem>

#if defined(__SANITIZE_ADDRESS__)
#define RAYLIGN_SHADOW_MEMORY true
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(memory_sanitizer) || __has_feature(thread_sanitizer)
#define RAYLIGN_SHADOW_MEMORY true
#endif
#endif
#ifndef RAYLIGN_SHADOW_MEMORY
#define RAYLIGN_SHADOW_MEMORY false
#endif

namespace raylign::detail {

/// Built with a sanitizer, whose shadow counts as memory and is larger than any machine: there is no limit then.
inline constexpr bool kHasShadowMemory = RAYLIGN_SHADOW_MEMORY;

/// What reading one file may cost.
struct DecodeLimits {
    double time_s = 0;             ///< wall time
    std::size_t memory_bytes = 0;  ///< beyond what the process has to begin with; 0 = no limit
};

/// Generous: no good file meets them. 120 s and 1 s per MB of the file; 1 GiB and 2200 times the file's bytes (twice
/// what deflate can pack), and never more than the machine or the container has. A header whose pixels are in another
/// file says nothing of their number: it has the machine's memory, and time as if it filled half of that.
[[nodiscard]] DecodeLimits limits_for(const std::filesystem::path& path);

}  // namespace raylign::detail
