#pragma once

#include <cstdint>

#include "raylign/image.h"

namespace raylign {

/// Adds quantum noise to a line-integral image:
///   counts ~ Poisson(photons exp(-I)),  I' = -log(max(counts, 1/2) / photons).
/// `photons` = mean count of an unattenuated pixel, in [1, 1e9]. Same seed, same noise on every machine (own sampling,
/// no library distributions). Throws Error for photons outside the range and for a pixel that is not finite or below
/// -13 (its count would exceed what double holds exactly).
[[nodiscard]] Image with_photon_noise(const Image& line_integral, double photons, std::uint64_t seed);

}  // namespace raylign
