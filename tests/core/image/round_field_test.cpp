#include "core/image/round_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/random.h"
#include "core/image/auto_mask.h"
#include "raylign/intensity.h"
#include "raylign/io/image.h"
#include "tests/support/errors.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

constexpr int kSide = 256;

/// A trunk that fills the field: thin at the left (L = 0.5), at the right as dark as the scattered light outside, with
/// ribs across; 1000 photons a pixel of air.
double trunk(double x, double y) {
    const double thickness = 0.5 + 3.2 * x / kSide + 0.25 * std::sin(0.25 * y + 0.1 * x);
    return 1000 * std::exp(-thickness) + 30;
}

template <typename Photons>
Image counted(const Photons& photons) {
    Random random(5);
    Image image(kSide, kSide);
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const double mean = photons(x, y);
            image(x, y) = static_cast<float>(mean + std::sqrt(mean) * random.normal());
        }
    }
    return image;
}

/// Scattered light outside, brightest near the edge.
Image round_view(double centre_x, double centre_y, double radius) {
    return counted([=](double x, double y) {
        const double beyond = std::hypot(x - centre_x, y - centre_y) - radius;
        return beyond > 0 ? 20 + 30 * std::exp(-beyond / 20) : trunk(x, y);
    });
}

TEST(RoundField, IsFoundWhereOutsideIsAsBrightAsTheBody) {
    for (const auto& [x, y, radius] : {std::array{127.5, 127.5, 122.0}, {133.0, 121.0, 118.0}, {127.5, 127.5, 150.0}}) {
        const Image image = round_view(x, y, radius);
        EXPECT_TRUE(mask_frame(image, {}).weights.empty()) << "a threshold would do";
        const auto circle = round_field_by_its_step(image);
        ASSERT_TRUE(circle) << radius;
        EXPECT_NEAR(circle->x, x, 1);
        EXPECT_NEAR(circle->y, y, 1);
        EXPECT_NEAR(circle->radius, radius, 1);
    }
}

TEST(RoundField, MasksWhatLiesOutsideAndLittleMore) {
    const Image mask = mask_stepped_field(round_view(127.5, 127.5, 122), {}).weights;
    ASSERT_FALSE(mask.empty());
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const double within = 122 - std::hypot(x - 127.5, y - 127.5);
            if (within < 1) EXPECT_EQ(mask(x, y), 0) << x << ' ' << y;
            if (within > 6) EXPECT_EQ(mask(x, y), 1) << x << ' ' << y;
        }
    }
}

TEST(RoundField, IsNotSeenInOpenPanels) {
    EXPECT_FALSE(round_field_by_its_step(counted(trunk)));
    const auto vignetted = [](double x, double y) {
        return trunk(x, y) * std::exp(-std::hypot(x - 128, y - 128) / 90);
    };
    EXPECT_FALSE(round_field_by_its_step(counted(vignetted)));
    const auto head = [](double x, double y) {  // darker than the air around it, and nearly round
        const double inside = 1 - std::pow((x - 128) / 112, 2) - std::pow((y - 128) / 122, 2);
        return 1000 * std::exp(-2.5 * std::sqrt(std::max(0.0, inside)));
    };
    EXPECT_FALSE(round_field_by_its_step(counted(head)));
    const auto oval = [](double x, double y) {  // brighter than what is around it: a head with its contrast reversed
        return std::pow((x - 128) / 100, 2) + std::pow((y - 128) / 122, 2) < 1 ? 400.0 : 50.0;
    };
    EXPECT_FALSE(round_field_by_its_step(counted(oval)));
    EXPECT_FALSE(round_field_by_its_step(Image(kSide, kSide, 7)));
    EXPECT_FALSE(round_field_by_its_step(Image(kSide, kSide, 0)));
    EXPECT_FALSE(round_field_by_its_step(Image(20, 20, 7)));
}

TEST(RoundField, IsNotSeenInRealOpenPanels) {
    for (const char* name : {"knee/AT_K1_V1_0160.tif", "knee/AT_K1_V1_0170.tif", "knee-biplane/cam1/f001.tif",
                             "knee-biplane/cam2/f001.tif"}) {
        RAYLIGN_NEED_DATA(test::test_data() / name);
        EXPECT_TRUE(mask_stepped_field(read_xray(test::test_data() / name).image, {}).weights.empty()) << name;
    }
}

}  // namespace
}  // namespace raylign::detail
