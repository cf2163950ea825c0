#pragma once

#include <filesystem>

#include "bench/record.h"
#include "raylign/backend.h"

namespace raylign::detail::bench {

inline constexpr double kCentreBound_mm = 0.5, kRotationBound_deg = 2;  ///< of a success

/// The radius and a metacarpal (the third; then the second and third as one bone) of one instant, registered together
/// and each alone as a part from the same starts, up to most_mm off. The radius is told against its reference; a
/// metacarpal, which has none, starts about where one global search found the third, and is told by how far its poses
/// lie from the one that is nearest to all others. Adds a row per metacarpal and way.
void run_together(const std::filesystem::path& folder, int instant, int starts, double most_mm, Backend& backend,
                  Record& record);

}  // namespace raylign::detail::bench
