#pragma once

#include <cstdint>

#include "core/base/random.h"
#include "raylign/image.h"

namespace raylign {

/// A Poisson number of any mean in [0, 1e15]; exact in distribution, no normal approximation. Below a mean of 10 by
/// inversion (sequential search), from 10 on by transformed rejection, PTRS of [Hormann 1993], "The transformed
/// rejection method for generating Poisson random variables". Same state of `random`, same number on every machine: the
/// decisions depend on exp and log only in their last bit.
[[nodiscard]] double poisson(Random& random, double mean);

/// Adds quantum noise to a line-integral image: counts ~ Poisson(photons exp(-I)), I' = -log(max(counts, 1/2) /
/// photons). `photons` = mean count of an unattenuated pixel, in [1, 1e9]. Same seed, same noise on every machine (own
/// sampling, no library distributions). Throws Error for photons outside the range and for a pixel that is not finite
/// or below -13 (its count would exceed what double holds exactly).
[[nodiscard]] Image with_photon_noise(const Image& line_integral, double photons, std::uint64_t seed);

}  // namespace raylign
