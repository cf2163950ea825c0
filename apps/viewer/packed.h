#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace raylign::detail::apps {

/// Bytes as a page carries them: deflated (RFC 1950; a browser's DecompressionStream("deflate") reads it), then base64.
[[nodiscard]] std::string packed(std::span<const std::uint8_t> bytes);

}  // namespace raylign::detail::apps
