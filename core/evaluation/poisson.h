#pragma once

#include "core/base/random.h"

namespace raylign::detail {

/// A Poisson number of any mean in [0, 1e15]; exact in distribution, no normal approximation. Below a mean of 10 by
/// inversion (sequential search), from 10 on by transformed rejection, PTRS of [Hormann93], "The transformed
/// rejection method for generating Poisson random variables". Same state of `random`, same number on every machine: the
/// decisions depend on exp and log only in their last bit.
[[nodiscard]] double poisson(Random& random, double mean);

}  // namespace raylign::detail
