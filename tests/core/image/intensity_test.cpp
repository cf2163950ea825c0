#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/base/error.h"
#include "raylign/intensity.h"
#include "raylign/io/image.h"
#include "tests/support/errors.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

const float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(HuPresets, DefaultIsWaterAt70Kev) {
    const HuPreset& preset = hu_presets().front();
    EXPECT_EQ(preset.name, "water-70kev");
    EXPECT_EQ(preset.water_per_mm, 0.0193);
    EXPECT_EQ(preset.cutoff_hu, -900);
}
TEST(HuPresets, EachHasASource) {
    for (const HuPreset& preset : hu_presets()) EXPECT_NE(preset.source, "") << preset.name;
}
TEST(HuPresets, UnknownNameListsAll) {
    EXPECT_THAT(error_of([] { (void)hu_preset("water"); }), AllOf(HasSubstr("water-70kev"), HasSubstr("water-60kev"),
                                                                  HasSubstr("water-80kev"), HasSubstr("plastimatch")));
}
TEST(HuPresets, AttenuationIsAffineAboveTheCutOffAndZeroBelow) {
    const HuPreset& preset = hu_preset("water-60kev");
    EXPECT_EQ(attenuation_from_hu(-900, preset), 0);
    EXPECT_FLOAT_EQ(attenuation_from_hu(-899, preset), static_cast<float>(0.0206 * 0.101));
    EXPECT_FLOAT_EQ(attenuation_from_hu(0, preset), 0.0206F);
    EXPECT_FLOAT_EQ(attenuation_from_hu(1000, preset), 0.0412F);
    EXPECT_EQ(attenuation_from_hu(-3024, preset), 0);
}

/// Line integrals of a ball, 0 around it, at most 3.
Image ball(double radius_px = 20) {
    Image image(64, 64);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const double r = std::hypot(x - 31.5, y - 31.5) / radius_px;
            image(x, y) = r < 1 ? static_cast<float>(3 * std::sqrt(1 - r * r)) : 0.0F;
        }
    }
    return image;
}

/// What an 8-bit detector with I0 = 250 stores of it.
RawXray detector_image(bool inverted, double radius_px = 20) {
    RawXray raw{ball(radius_px), true, 255, false};
    for (float& value : raw.image.pixels) {
        value = std::round(250 * std::exp(-value));
        if (inverted) value = 255 - value;
    }
    return raw;
}

/// Half a count of 250 exp(-3) = 12.4 is 4 % of it.
constexpr double kQuantised = 0.045;

void expect_ball(const Image& image, double tolerance) {
    const Image truth = ball();
    double worst = 0;
    for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
        worst = std::max<double>(worst, std::abs(image.pixels[i] - truth.pixels[i]));
    }
    EXPECT_LT(worst, tolerance);
}

TEST(XrayConversion, DetectorCountsBecomeLineIntegrals) {
    const XrayConversion result = line_integral_from_xray(detector_image(false), {}, {}, "a.png");
    expect_ball(result.line_integral, kQuantised);
    EXPECT_TRUE(result.weights.empty());
    EXPECT_THAT(result.decisions, Contains(HasSubstr("kind: transmission")));
    EXPECT_THAT(result.decisions, Contains(AllOf(HasSubstr("polarity: bone dark"), HasSubstr("%"))));
    EXPECT_THAT(result.decisions, Contains(HasSubstr("I0 = 250")));
}

TEST(XrayConversion, BoneBrightImageIsRecognisedAndInverted) {
    const XrayConversion result = line_integral_from_xray(detector_image(true), {}, {}, "a.png");
    expect_ball(result.line_integral, kQuantised);
    EXPECT_THAT(result.decisions, Contains(HasSubstr("polarity: bone bright")));
}

/// Weights must be 0 outside the field and up to 2 px within it, 1 from 5 px within, but for a pixel of the mask.
void expect_bone_dark_by_frame(const RawXray& raw, const std::function<double(int, int)>& px_within) {
    Image mask(64, 64, 1);
    mask(30, 30) = 0;
    const XrayConversion result = line_integral_from_xray(raw, mask, {}, "a.png");
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            const bool is_masked = x == 30 && y == 30;
            if (px_within(x, y) < 2 || is_masked) {
                EXPECT_EQ(result.weights(x, y), 0) << x << ' ' << y;
            }
            if (px_within(x, y) > 5 && !is_masked) {
                EXPECT_EQ(result.weights(x, y), 1) << x << ' ' << y;
            }
        }
    }
    EXPECT_THAT(result.decisions, Contains(AllOf(HasSubstr("field of view"), HasSubstr("% of the pixels"))));
    EXPECT_THAT(result.decisions, Contains(AllOf(HasSubstr("polarity: bone dark"), HasSubstr("outside the field"))));
}

TEST(XrayConversion, DarkFrameOfARoundFieldIsNotTakenForAir) {
    RawXray raw = detector_image(false, 26);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            if (std::hypot(x - 31.5, y - 31.5) > 29.5) raw.image(x, y) = 0;  // more pixels than the ring of air within
        }
    }
    expect_bone_dark_by_frame(raw, [](int x, int y) { return 29.5 - std::hypot(x - 31.5, y - 31.5); });
}

TEST(XrayConversion, DarkFrameOfACollimatorIsNotTakenForAir) {
    RawXray raw = detector_image(false, 22);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) {
            if (x < 12 || x > 54 || y < 9 || y > 52) raw.image(x, y) = static_cast<float>((x + y) % 3);
        }
    }
    expect_bone_dark_by_frame(raw, [](int x, int y) { return std::min({x - 12, 54 - x, y - 9, 52 - y}); });
}

TEST(XrayConversion, AirAroundABrightBodyIsNotTakenForACollimator) {
    RawXray raw = detector_image(true);
    for (int y = 20; y < 64; ++y) {
        for (int x = 25; x < 40; ++x) raw.image(x, y) = 200;  // a limb that leaves the image
    }
    EXPECT_THAT(line_integral_from_xray(raw, {}, {}, "a.png").decisions, Contains(HasSubstr("polarity: bone bright")));
}

TEST(XrayConversion, Monochrome1CountsAreBoneDark) {
    RawXray raw = detector_image(false);
    raw.monochrome1 = true;
    const XrayConversion result = line_integral_from_xray(raw, {}, {}, "a.dcm");
    expect_ball(result.line_integral, kQuantised);
    EXPECT_THAT(result.decisions, Contains(HasSubstr("MONOCHROME1")));
}

TEST(XrayConversion, StatedSettingsAreNotQuestioned) {
    const IntensitySettings settings{IntensityKind::transmission, Polarity::bone_dark, 200};
    const XrayConversion result = line_integral_from_xray(detector_image(false), {}, settings, "a.png");
    EXPECT_NEAR(result.line_integral(0, 0), -std::log(250.0 / 200), 1e-6);
    EXPECT_TRUE(result.decisions.empty()) << result.decisions.front();
}

TEST(XrayConversion, ZeroCountsAreFlooredAtHalfACount) {
    RawXray raw{Image(8, 8, 100), true, 255, false};
    raw.image(3, 3) = 0;
    const IntensitySettings settings{IntensityKind::transmission, Polarity::bone_dark, 100};
    const XrayConversion result = line_integral_from_xray(raw, {}, settings, "a.png");
    EXPECT_NEAR(result.line_integral(3, 3), std::log(200.0), 1e-6);
    EXPECT_THAT(result.decisions, Contains(HasSubstr("1 pixels below 0.5")));
}

TEST(XrayConversion, FloatPixelsAreLineIntegralsAndStayAsTheyAre) {
    const XrayConversion result = line_integral_from_xray({ball(), false, 0, false}, {}, {}, "a.tif");
    EXPECT_EQ(result.line_integral.pixels, ball().pixels);
    EXPECT_THAT(result.decisions, Contains(HasSubstr("kind: line integral")));
}

TEST(XrayConversion, BoneDarkLineIntegralsChangeSign) {
    const IntensitySettings settings{IntensityKind::line_integral, Polarity::bone_dark, {}};
    const XrayConversion result = line_integral_from_xray({ball(), false, 0, false}, {}, settings, "a.tif");
    EXPECT_EQ(result.line_integral(32, 32), -ball()(32, 32));
}

TEST(XrayConversion, NonFinitePixelsLoseTheirWeight) {
    RawXray raw{ball(), false, 0, false};
    raw.image(5, 6) = kNan;
    Image mask(64, 64, 1);
    mask(1, 1) = 0;
    const XrayConversion result = line_integral_from_xray(raw, mask, {}, "a.tif");
    EXPECT_EQ(result.weights(5, 6), 0);
    EXPECT_EQ(result.weights(1, 1), 0);
    EXPECT_EQ(result.weights(6, 5), 1);
    EXPECT_TRUE(std::isfinite(result.line_integral(5, 6)));
    EXPECT_THAT(result.decisions, Contains(HasSubstr("1 pixels are not finite")));
}

TEST(XrayConversion, MaskedPixelsDoNotSetI0) {
    RawXray raw = detector_image(false);
    Image mask(64, 64, 1);
    for (int x = 0; x < 64; ++x) {
        raw.image(x, 0) = 255;  // a bright frame
        mask(x, 0) = 0;
    }
    EXPECT_THAT(line_integral_from_xray(raw, mask, {}, "a.png").decisions, Contains(HasSubstr("I0 = 250")));
}

TEST(XrayConversion, BadInputIsNamed) {
    const RawXray raw{ball(), true, 255, false};
    const RawXray blind{Image(4, 4, kNan), false, 0, false};
    EXPECT_THAT(error_of([&] { (void)line_integral_from_xray(raw, {}, {.i0 = 0}, "a.png"); }),
                AllOf(HasSubstr("i0 = 0"), HasSubstr("a.png"), HasSubstr("positive")));
    EXPECT_THAT(error_of([&] { (void)line_integral_from_xray(raw, Image(3, 4, 1), {}, "a.png"); }),
                AllOf(HasSubstr("3 x 4"), HasSubstr("64 x 64")));
    EXPECT_THAT(error_of([&] { (void)line_integral_from_xray(blind, {}, {}, "a.png"); }), HasSubstr("no finite pixel"));
    EXPECT_THAT(error_of([&] { (void)line_integral_from_xray(raw, Image(64, 64, 0), {}, "a.png"); }),
                HasSubstr("mask"));
    const RawXray dark{Image(4, 4, 0), true, 255, false};
    EXPECT_THAT(error_of([&] { (void)line_integral_from_xray(dark, {}, {}, "a.png"); }), HasSubstr("I0"));
}

constexpr double kWristOutside = 1.04, kWristInside = 0.95;  // of half the image's width

/// The field is round, its edge is off the image's middle by up to 3 % of the radius, and its corners are black.
void expect_round_field(const Image& image, const Image& weights) {
    const double cx = (image.width - 1) / 2.0, cy = (image.height - 1) / 2.0;
    std::size_t wrong_outside = 0, wrong_inside = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const double r = std::hypot(x - cx, y - cy) / cx;
            wrong_outside += r > kWristOutside && weights(x, y) != 0;
            wrong_inside += r < kWristInside && weights(x, y) != 1;
        }
    }
    EXPECT_EQ(wrong_outside, 0U);
    EXPECT_EQ(wrong_inside, 0U);
}

TEST(XrayConversion, WristXraysAreBoneDarkWithSaturatedAir) {
    for (const char* name : {"xr_rad_uln_cam01_UND.0002.tif", "xr_rad_uln_cam01_UND.0099.tif",
                             "xr_rad_uln_cam02_UND.0002.tif", "xr_rad_uln_cam02_UND.0099.tif"}) {
        const auto path = test::test_data() / "wrist" / name;
        RAYLIGN_NEED_DATA(path);
        const RawXray raw = read_xray(path);
        EXPECT_EQ(raw.image.width, 1760);
        EXPECT_EQ(raw.max_representable, 255);
        const XrayConversion result = line_integral_from_xray(raw, {}, {}, name);
        EXPECT_THAT(result.decisions, Contains(HasSubstr("polarity: bone dark"))) << name;
        EXPECT_THAT(result.decisions, Contains(HasSubstr("I0 = 255"))) << name;
        expect_round_field(raw.image, result.weights);
    }
}

}  // namespace
}  // namespace raylign::detail
