#pragma once

#define RAYLIGN_VERSION_MAJOR 0
#define RAYLIGN_VERSION_MINOR 2
#define RAYLIGN_VERSION_PATCH 0
#define RAYLIGN_VERSION "0.2.0"

namespace raylign {

/// Version of the library that runs; RAYLIGN_VERSION is that of the headers. Those of one minor version go together.
[[nodiscard]] const char* version() noexcept;

}  // namespace raylign
