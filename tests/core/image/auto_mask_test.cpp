#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/image/auto_mask.h"
#include "raylign/intensity.h"
#include "raylign/io/image.h"
#include "raylign/io/views.h"
#include "tests/support/errors.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

using testing::Contains;
using testing::HasSubstr;

/// A limb (dark band with a denser bone in it) across a field of air, as a detector of 12 bits sees it.
Image limb(int width, int height) {
    Image image(width, height, 3600);
    const auto smooth = [](double t) { return t * t * (3 - 2 * t); };  // edges as soft as a beam's and a bone's are
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double across = std::abs(x - 0.55 * width - 0.1 * (y - height / 2.0)) / (0.2 * width);
            if (across < 1) image(x, y) = static_cast<float>(3600 * std::exp(-1.2 * std::sqrt(1 - across * across)));
            if (across < 0.36)
                image(x, y) *= static_cast<float>(1 - 0.45 * smooth(std::clamp((0.36 - across) / 0.12, 0.0, 1.0)));
        }
    }
    return image;
}

/// Everything outside the field at 2 % of the air.
Image collimated(Image image, const std::function<double(double, double)>& px_within) {
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            if (px_within(x, y) < 0) image(x, y) = 70.0F + static_cast<float>((3 * x + 5 * y) % 7);
        }
    }
    return image;
}

/// Weight 0 outside and up to 2 px within, 1 from 8 px within.
void expect_field(const Image& weights, const std::function<double(double, double)>& px_within) {
    ASSERT_FALSE(weights.empty());
    int wrong_out = 0, wrong_in = 0;
    for (int y = 0; y < weights.height; ++y) {
        for (int x = 0; x < weights.width; ++x) {
            wrong_out += px_within(x, y) < 1.5 && weights(x, y) != 0;
            wrong_in += px_within(x, y) > 8 && weights(x, y) != 1;
        }
    }
    EXPECT_EQ(wrong_out, 0);
    EXPECT_EQ(wrong_in, 0);
}

double circle_px(double x, double y) { return 190 - std::hypot(x - 250, y - 210); }

double octagon_px(double x, double y) {
    double within = 1e9;
    for (int k = 0; k < 8; ++k) {
        const double angle = 0.2 + k * 0.785398163;
        within = std::min(within, 180 - (std::cos(angle) * (x - 240) + std::sin(angle) * (y - 205)));
    }
    return within;
}

/// Two blades, askew: the field reaches the image's border on the other sides.
double blades_px(double x, double y) {
    return std::min((x * std::cos(0.15) + y * std::sin(0.15)) - 90, 380 - (y * std::cos(0.1) - x * std::sin(0.1)));
}

TEST(MaskFrame, RoundFieldBesideTheMiddle) {
    const AutoMask mask = mask_frame(collimated(limb(520, 440), circle_px), {});
    expect_field(mask.weights, circle_px);
    EXPECT_THAT(mask.decisions, Contains(HasSubstr("round field")));
}

TEST(MaskFrame, OctagonalCollimator) {
    const AutoMask mask = mask_frame(collimated(limb(520, 440), octagon_px), {});
    expect_field(mask.weights, octagon_px);
    EXPECT_THAT(mask.decisions, Contains(HasSubstr("8 straight sides")));
}

TEST(MaskFrame, TwoBladesAskew) {
    expect_field(mask_frame(collimated(limb(520, 440), blades_px), {}).weights, blades_px);
}

TEST(MaskFrame, LargeImagesAreJudgedOnSmallOnes) {
    const auto field = [](double x, double y) { return 3 * circle_px(x / 3, y / 3); };
    expect_field(mask_frame(collimated(limb(1560, 1320), field), {}).weights, field);
}

TEST(MaskFrame, ALimbInAirIsNoCollimator) {
    EXPECT_TRUE(mask_frame(limb(520, 440), {}).weights.empty());
    Image dense = limb(520, 440);
    for (float& v : dense.pixels) v = v < 3000 ? 60 : v;  // as dark as a blade
    EXPECT_TRUE(mask_frame(dense, {}).weights.empty());
    Image noise(300, 200);
    for (std::size_t i = 0; i < noise.pixels.size(); ++i) noise.pixels[i] = static_cast<float>((i * 7919) % 1009);
    EXPECT_TRUE(mask_frame(noise, {}).weights.empty());
    EXPECT_TRUE(mask_frame(Image(300, 200, 5), {}).weights.empty());
    EXPECT_TRUE(mask_frame(Image(4, 4, 5), {}).weights.empty());
}

TEST(MaskMarks, LettersAndBeadsAreFoundAndBoneIsNot) {
    Image image = limb(520, 440);
    const auto mark = [&](int x0, int y0, int w, int h, float value) {
        for (int y = y0; y < y0 + h; ++y) {
            for (int x = x0; x < x0 + w; ++x) image(x, y) = value;
        }
    };
    mark(30, 30, 4, 24, 200);  // a lead "L" in the air
    mark(30, 50, 16, 4, 200);
    mark(280, 224, 6, 6, 30);     // a lead bead on the bone
    mark(285, 300, 14, 3, 4095);  // burnt-in white on the bone
    const AutoMask mask = mask_marks(image, {});
    ASSERT_FALSE(mask.weights.empty());
    for (const auto& [x, y] : {std::pair{31, 35}, {40, 51}, {282, 226}, {290, 301}})
        EXPECT_EQ(mask.weights(x, y), 0) << x;
    int masked = 0;
    for (const float w : mask.weights.pixels) masked += w == 0;
    EXPECT_LT(masked, 1200) << "of the limb, too";  // marks and 2 px around them, nothing of the limb
    EXPECT_TRUE(mask_marks(limb(520, 440), {}).weights.empty());
}

TEST(MaskClipped, SaturatedAndZeroPixelsAndTheirNeighbours) {
    Image image(20, 10, 100);
    image(5, 5) = 255;
    image(12, 3) = 0;
    const AutoMask mask = mask_clipped(image, 255);
    for (int y = 0; y < 10; ++y) {
        for (int x = 0; x < 20; ++x) {
            const bool near =
                std::max(std::abs(x - 5), std::abs(y - 5)) <= 1 || std::max(std::abs(x - 12), std::abs(y - 3)) <= 1;
            EXPECT_EQ(mask.weights(x, y), near ? 0 : 1) << x << ' ' << y;
        }
    }
    EXPECT_TRUE(mask_clipped(Image(20, 10, 100), 255).weights.empty());
    Image bright(40, 30, 100);
    bright(5, 5) = 255;
    EXPECT_TRUE(mask_clipped(bright, 0).weights.empty());  // one pixel is no plateau
}

TEST(AutoMask, IsOffUnlessAskedForAndKeepsTheOwnMask) {
    RawXray raw{collimated(limb(520, 440), octagon_px), true, 4095, false};
    Image own(520, 440, 1);
    own(250, 200) = 0;
    IntensitySettings settings;
    settings.auto_mask = true;
    const XrayConversion with = line_integral_from_xray(raw, own, settings, "a");
    EXPECT_EQ(with.weights(250, 200), 0);
    EXPECT_EQ(with.weights(2, 2), 0);
    EXPECT_THAT(with.decisions, Contains(HasSubstr("field of view: the dark border")));
    raw.image = limb(520, 440);
    EXPECT_TRUE(line_integral_from_xray(raw, {}, {}, "a").weights.empty());
}

TEST(AutoMask, ShutterOfTheFileCounts) {
    RawXray raw{limb(60, 40), true, 4095, false};
    raw.shutter = Image(60, 40, 1);
    raw.shutter(3, 4) = 0;
    IntensitySettings settings;
    settings.auto_mask = true;
    const XrayConversion with = line_integral_from_xray(raw, {}, settings, "a");
    ASSERT_FALSE(with.weights.empty());
    EXPECT_EQ(with.weights(3, 4), 0);
    EXPECT_EQ(with.weights(30, 20), 1);
}

TEST(AutoMask, RealWristXraysKeepTheBonesAndLoseTheRest) {
    const auto data = test::test_data() / "wrist";
    for (const char* name : {"xr_rad_uln_cam01_UND.0002.tif", "xr_rad_uln_cam02_UND.0002.tif",
                             "xr_rad_uln_cam01_UND.0099.tif", "xr_rad_uln_cam02_UND.0099.tif"}) {
        RAYLIGN_NEED_DATA(data / name);
        IntensitySettings settings;
        settings.auto_mask = true;
        const XrayConversion x = line_integral_from_xray(read_xray(data / name), {}, settings, name);
        for (const auto& [u, v] : {std::pair{3, 3}, {1756, 3}, {3, 1756}, {1756, 1756}}) EXPECT_EQ(x.weights(u, v), 0);
        double used = 0;
        for (const float w : x.weights.pixels) used += w;
        EXPECT_GT(used / static_cast<double>(x.weights.pixels.size()), 0.15) << name;
    }
}

}  // namespace
}  // namespace raylign::detail
