#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/validation/differences.h"

namespace raylign::detail::validation {
namespace {

TEST(Largest, KeepsTheLargestItsPlaceAndTheRootMeanSquare) {
    Largest largest;
    largest.add(3, "a");
    largest.add(-4, "b");
    largest.add(0, "c");
    EXPECT_EQ(largest.value(), 4);
    EXPECT_EQ(largest.where(), "b");
    EXPECT_NEAR(largest.rms(), 5 / std::sqrt(3), 1e-15);
}

TEST(Largest, TakesNanForInfinite) {
    Largest largest;
    largest.add(NAN, "here");
    largest.add(1, "there");
    EXPECT_TRUE(std::isinf(largest.value()));
    EXPECT_EQ(largest.where(), "here");
}

TEST(AddImage, GivesSharesOfTheOraclesMaximumAndThePixel) {
    Image oracle(3, 2, 1), other(3, 2, 1);
    oracle(0, 0) = other(0, 0) = 4;
    other(2, 1) = 1.5F;
    Largest largest;
    add_image(largest, other, oracle, "view A");
    EXPECT_EQ(largest.value(), 0.125);
    EXPECT_THAT(largest.where(), testing::HasSubstr("view A, pixel (2, 1): 1.5"));
    EXPECT_NEAR(largest.rms(), 0.125 / std::sqrt(6), 1e-15);
}

TEST(AddImage, AnotherSizeIsInfinitelyFar) {
    Largest largest;
    add_image(largest, Image(3, 2), Image(2, 3), "view");
    EXPECT_TRUE(std::isinf(largest.value()));
}

TEST(MinimumByParabola, IsExactForAParabola) {
    std::vector<double> offsets, costs;
    for (int i = -3; i <= 3; ++i) {
        offsets.push_back(0.5 * i);
        costs.push_back(2 + (0.5 * i - 0.3) * (0.5 * i - 0.3));
    }
    EXPECT_NEAR(minimum_by_parabola(offsets, costs), 0.3, 1e-14);
}

TEST(MinimumByParabola, IsNoneAtAnEndAndForNan) {
    EXPECT_TRUE(std::isnan(minimum_by_parabola(std::vector<double>{0, 1, 2}, std::vector<double>{1, 2, 3})));
    EXPECT_TRUE(std::isnan(minimum_by_parabola(std::vector<double>{0, 1, 2}, std::vector<double>{3, 2, 1})));
    EXPECT_TRUE(std::isnan(minimum_by_parabola(std::vector<double>{0, 1, 2}, std::vector<double>{3, NAN, 4})));
    EXPECT_TRUE(std::isnan(minimum_by_parabola({}, {})));
}

}  // namespace
}  // namespace raylign::detail::validation
