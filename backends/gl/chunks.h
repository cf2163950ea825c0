#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace raylign::detail::gl {

/// Frames that are submitted together; a frame that takes too long alone is cut into parts by rows.
struct Chunk {
    std::size_t first = 0, count = 0;
    int row_parts = 1;
};

struct ChunkLimits {
    double samples_per_ms = 1;    ///< that the device takes, as measured
    double most_ms = 50;          ///< half of what must not be exceeded: rates vary
    std::size_t most_frames = 1;  ///< that there is memory for
};

/// Cuts a batch so that no submission takes longer than `most_ms`: drivers reset devices that do not answer for
/// seconds. `samples`: per frame.
[[nodiscard]] std::vector<Chunk> plan_chunks(std::span<const double> samples, const ChunkLimits& limits);

}  // namespace raylign::detail::gl
