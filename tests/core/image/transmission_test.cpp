#include "core/image/transmission.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/geometry/ray_frame.h"

namespace raylign::detail {
namespace {

constexpr double kFloatTolerance = 1e-6;  // of the image's range of 0.1: rounding of floats

/// What a detector that saturates at `ceiling` shows of line integrals 0 to 10.
View ramp(double ceiling) {
    View view{"ramp", {}, Image(101, 1), {}};
    view.ceiling = ceiling;
    view.by_transmission = true;
    for (int x = 0; x <= 100; ++x) view.image(x, 0) = saturated(0.1F * x, static_cast<float>(ceiling)).line_integral;
    return view;
}

TEST(Transmission, AnImageBecomesWhatADrrShowsUnderTheNewCeiling) {
    for (const double ceiling : {0.5, 1.2, 4.0, std::numeric_limits<double>::infinity()}) {
        const View shown = as_compared(std::vector{ramp(ceiling)}).front();
        EXPECT_EQ(shown.ceiling, kCeiling_transmission);
        EXPECT_FALSE(shown.by_transmission);
        for (int x = 0; x <= 100; ++x) {
            const float drr = saturated(0.1F * x, static_cast<float>(shown.ceiling)).line_integral;
            EXPECT_NEAR(shown.image(x, 0), drr, kFloatTolerance) << ceiling << ", " << 0.1 * x;
        }
    }
}

TEST(Transmission, ABlurOfWhatArrivesMovesNoEdge) {
    // Half of the beam arrives at the edge of thick metal, and of what a pixel's half shows it is half of the range;
    // the logarithm has the same edge at a tenth.
    View view{"edge", {}, Image(3, 1), {}};
    view.image.pixels = {0, static_cast<float>(std::log(2.0)), 20};
    const Image shown = shown_as_transmission(view).image;
    EXPECT_NEAR(shown(1, 0) / shown(2, 0), 0.5, kCeiling_transmission / 4);
    EXPECT_LT(view.image(1, 0) / view.image(2, 0), 0.04);
}

TEST(Transmission, OtherViewsStayAsTheyAre) {
    View view = ramp(1.2);
    view.by_transmission = false;
    const View same = as_compared(std::vector{view}).front();
    EXPECT_EQ(same.image.pixels, view.image.pixels);
    EXPECT_EQ(same.ceiling, 1.2);
    const View low = shown_as_transmission(ramp(0.05));
    EXPECT_EQ(low.image.pixels, ramp(0.05).image.pixels);
    EXPECT_EQ(low.ceiling, 0.05);
}

TEST(Transmission, PixelsThatAreNoNumbersStaySoAndBrightOnesStayFinite) {
    View view{"odd", {}, Image(2, 1), {}};
    view.image.pixels = {std::numeric_limits<float>::quiet_NaN(), -1e6F};
    const Image shown = shown_as_transmission(view).image;
    EXPECT_TRUE(std::isnan(shown(0, 0)));
    EXPECT_TRUE(std::isfinite(shown(1, 0)));
}

}  // namespace
}  // namespace raylign::detail
