#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "raylign/image.h"

namespace raylign::detail::test {

/// EXPECT_TRUE(images_near(actual, expected, share)): every pixel within `share` of the expected image's maximum; a
/// failure says how far off, where, and what both images hold there.
inline testing::AssertionResult images_near(const Image& actual, const Image& expected, double share) {
    if (actual.width != expected.width || actual.height != expected.height) {
        return testing::AssertionFailure() << "sizes " << actual.width << " x " << actual.height << " and "
                                           << expected.width << " x " << expected.height;
    }
    double maximum = 0, largest = 0, sum = 0;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
        maximum = std::max(maximum, std::abs(static_cast<double>(expected.pixels[i])));
        const double error = std::abs(static_cast<double>(actual.pixels[i]) - expected.pixels[i]);
        sum += error;
        if (!(error <= largest)) {  // NaN is the worst
            largest = error;
            worst = i;
        }
    }
    if (largest <= share * maximum) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "max " << largest / maximum << " (allowed " << share << "), mean "
                                       << sum / static_cast<double>(expected.pixels.size()) / maximum
                                       << " of the maximum " << maximum << "; at (" << worst % expected.width << ", "
                                       << worst / expected.width << "): " << actual.pixels[worst] << ", expected "
                                       << expected.pixels[worst];
}

}  // namespace raylign::detail::test
