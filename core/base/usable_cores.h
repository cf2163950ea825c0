#pragma once

namespace raylign::detail {

/// Cores that this process may use, at least 1: its affinity mask, which std::thread::hardware_concurrency need not
/// ask.
[[nodiscard]] int usable_cores();

}  // namespace raylign::detail
