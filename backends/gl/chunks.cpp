#include "backends/gl/chunks.h"

#include <algorithm>
#include <cmath>

namespace raylign::detail::gl {
namespace {

constexpr double kMostParts = 4096;

}  // namespace

std::vector<Chunk> plan_chunks(std::span<const double> samples, const ChunkLimits& limits) {
    const double most = limits.samples_per_ms * limits.most_ms;
    std::vector<Chunk> chunks;
    double in_chunk = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const bool fits = !chunks.empty() && chunks.back().count < limits.most_frames && in_chunk + samples[i] <= most;
        if (fits) {
            ++chunks.back().count;
            in_chunk += samples[i];
            continue;
        }
        const int parts = static_cast<int>(std::clamp(std::ceil(samples[i] / most), 1.0, kMostParts));
        chunks.push_back({i, 1, parts});
        in_chunk = samples[i];
    }
    return chunks;
}

}  // namespace raylign::detail::gl
