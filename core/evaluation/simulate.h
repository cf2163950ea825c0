#pragma once

#include <cstdint>

#include "core/image/image.h"

namespace raylign {

/// Adds quantum noise to a line-integral image: counts ~ Poisson(photons exp(-I)), I' = -log(max(counts, 1/2) / photons).
/// `photons` = mean count of an unattenuated pixel, in [1, 1e9]. Same seed, same noise on every machine (own sampling, no
/// library distributions).
[[nodiscard]] Image with_photon_noise(const Image& line_integral, double photons, std::uint64_t seed);

}  // namespace raylign
