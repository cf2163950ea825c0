#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/evaluation/xray_parts.h"
#include "raylign/backends.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using testing::HasSubstr;

MaterialPaths slab(float water, float bone = 0, int side = 40) {
    return {Image(side, side, water), Image(side, side, bone), 70, {0.5, 0.5}, 0, 2};
}

double mean_of(const Image& image) {
    double sum = 0;
    for (const float value : image.pixels) sum += value;
    return sum / static_cast<double>(image.pixels.size());
}

double variance_of(const Image& image) {
    const double mean = mean_of(image);
    double sum = 0;
    for (const float value : image.pixels) sum += (value - mean) * (value - mean);
    return sum / static_cast<double>(image.pixels.size());
}

TEST(XrayExposure, OneEnergyAndNothingElseIsTheLineIntegral) {
    const XrayExposure exposure = expose_paths(XrayModel{}, slab(1.25F, 0.5F));
    for (const float value : exposure.energy.pixels) EXPECT_NEAR(-std::log(value), 1.75, 1e-6);
    EXPECT_EQ(exposure.energy.pixels, exposure.energy_squared.pixels);
    const RawXray raw = detected(XrayModel{}, exposure, 1);
    EXPECT_EQ(raw.image.width, 20);
    EXPECT_FALSE(raw.integer_pixels);
    IntensitySettings settings;
    settings.i0 = 1;
    const XrayConversion read = line_integral_from_xray(raw, {}, settings, "slab");
    for (const float value : read.line_integral.pixels) EXPECT_NEAR(value, 1.75, 1e-6);
}

// Two energies by hand, from the table: water 0.2683 and 0.1837 cm2/g at 40 and 80 keV, and at 60, where the paths
// are, 0.2059. Energy detected: weights times keV, 20 and 40 of 60.
TEST(XrayExposure, AThickSlabIsMoreTransparentThanAThinOneSays) {
    XrayModel model;
    model.spectrum = {{40, 0.5}, {80, 0.5}};
    double thin = std::numeric_limits<double>::infinity();
    for (const double integral : {0.01, 1.0, 4.0}) {
        MaterialPaths paths = slab(static_cast<float>(integral));
        paths.energy_kev = 60;
        const double expected =
            -std::log(std::exp(-integral * 0.2683 / 0.2059) / 3 + 2 * std::exp(-integral * 0.1837 / 0.2059) / 3);
        const double seen = -std::log(expose_paths(model, paths).energy(3, 3));
        EXPECT_NEAR(seen, expected, 1e-5) << integral;
        EXPECT_LT(seen / integral, thin) << integral;
        thin = seen / integral;
    }
}

TEST(XrayExposure, ASoftBeamSeesMoreBoneThanTheCt) {
    XrayModel model;
    model.spectrum = {{40, 1}};
    const double water = -std::log(expose_paths(model, slab(1)).energy(3, 3));
    const double bone = -std::log(expose_paths(model, slab(0, 1)).energy(3, 3));
    const double by_table = (0.6655 / mass_attenuation_cm2_per_g(BodyMaterial::cortical_bone, 70)) /
                            (0.2683 / mass_attenuation_cm2_per_g(BodyMaterial::water, 70));
    EXPECT_NEAR(bone / water, by_table, 1e-5);
    EXPECT_GT(by_table, 1.8);
}

// A small absorbing spot in the middle of a wide image: what scatters comes back in full, ratio * sum of P tau.
TEST(XrayExposure, ScatterIsTheRatioOfWhatPassesThroughTheBodyAndNoneOfAir) {
    MaterialPaths paths = slab(0, 0, 400);
    for (int y = 180; y < 220; ++y) {
        for (int x = 180; x < 220; ++x) paths.water(x, y) = 2;
    }
    XrayModel model;
    const double primary = mean_of(expose_paths(model, paths).energy);
    model.scatter_ratio = 0.3;
    model.scatter_near_mm = 4;
    model.scatter_far_mm = 12;
    const XrayExposure with = expose_paths(model, paths);
    const double source = 40.0 * 40 / (400 * 400) * 2 * std::exp(-2.0);
    EXPECT_NEAR(mean_of(with.energy) - primary, 0.3 * source, 0.002 * 0.3 * source);
    EXPECT_NEAR(with.energy(0, 0), 1, 1e-5) << "far from the body nothing is added";
    EXPECT_GT(with.energy(170, 200), 1.001) << "beside it there is";
}

TEST(XrayExposure, FocalSpotBlursThePrimaryByItsPenumbra) {
    MaterialPaths paths = slab(0, 0, 80);
    for (int y = 0; y < 80; ++y) {
        for (int x = 40; x < 80; ++x) paths.water(x, y) = 3;
    }
    paths.penumbra_mm = 2;  // 4 samples
    const Image soft = expose_paths(XrayModel{}, paths).energy;
    const double dark = std::exp(-3.0), middle = (soft(39, 40) + soft(40, 40)) / 2;
    EXPECT_NEAR(middle, (1 + dark) / 2, 1e-4);
    // One sigma from the edge: 84.13 % of the step.
    EXPECT_NEAR((soft(35, 40) + soft(36, 40)) / 2, dark + 0.8413 * (1 - dark), 0.003);
    EXPECT_NEAR(soft(2, 40), 1, 1e-5);
}

TEST(XrayExposure, BladesRoundFieldAndMarkerAreDark) {
    XrayModel model;
    model.blade_share = {0.1, 0};
    model.round_field_share = 1;
    model.marker_share = 0.1;
    const Image field = expose_paths(model, slab(0, 0, 200)).energy;
    EXPECT_NEAR(field(19, 100), 0.003, 1e-6);
    EXPECT_NEAR(field(20, 100), 1, 1e-6);
    EXPECT_NEAR(field(25, 25), 0.003, 1e-6) << "outside of the circle";
    EXPECT_NEAR(field(46, 50), 0.05, 1e-6) << "the letter";
    EXPECT_NEAR(field(54, 48), 1, 1e-6) << "to the right of its stem";
    EXPECT_NEAR(field(54, 62), 0.05, 1e-6) << "its foot";
}

TEST(XrayDetector, NoiseHasTheVarianceOfTheSumOverEnergies) {
    XrayModel model;
    model.spectrum = {{40, 0.7}, {80, 0.3}};
    model.photons_per_mm2 = 4000;  // 1000 a sample of 0.5 mm
    const XrayExposure exposure = expose_paths(model, slab(1, 0, 600));
    ASSERT_DOUBLE_EQ(exposure.photons_per_sample, 1000);
    // Energy over the mean of 52 keV; sum of n_e e^2 over n^2 for a pixel of four samples.
    const double low = std::exp(-0.2683 / mass_attenuation_cm2_per_g(BodyMaterial::water, 70));
    const double high = std::exp(-0.1837 / mass_attenuation_cm2_per_g(BodyMaterial::water, 70));
    const double expected = (0.7 * low * std::pow(40 / 52.0, 2) + 0.3 * high * std::pow(80 / 52.0, 2)) / 4000;
    const Image image = detected(model, exposure, 5).image;
    const double pixels = 9e4;
    EXPECT_NEAR(variance_of(image), expected, 5 * expected * std::sqrt(2 / pixels));
    EXPECT_NEAR(mean_of(image), exposure.energy(0, 0), 5 * std::sqrt(expected / pixels));
}

TEST(XrayDetector, BlurCorrelatesTheNoiseAndKeepsTheMean) {
    XrayModel model;
    model.photons_per_mm2 = 4000;
    model.blur_mm = 2;  // 4 samples: sums of independent ones keep 1 / (4 pi sigma^2) of the variance
    const XrayExposure exposure = expose_paths(model, slab(0, 0, 600));
    const Image image = detected(model, exposure, 6).image;
    double neighbours = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 1; x < image.width; ++x) neighbours += (image(x, y) - 1) * (image(x - 1, y) - 1);
    }
    const double pixels = 9e4, variance = variance_of(image);
    const double expected = 1 / (1000 * 4 * std::numbers::pi * (16 + 0.2));
    EXPECT_NEAR(variance, expected, 0.1 * expected) << "sigma^2 widened by taps and pixels";
    EXPECT_NEAR(neighbours / pixels / variance, std::exp(-4 / (4 * 16.2)), 0.02);
    EXPECT_NEAR(mean_of(image), 1, 5 / std::sqrt(1000 * 36e4));
}

TEST(XrayDetector, ElectronicNoiseIsWhiteAndOfItsSize) {
    XrayModel model;
    model.electronic_noise = 0.01;
    model.blur_mm = 2;
    const Image image = detected(model, expose_paths(model, slab(0, 0, 600)), 7).image;
    EXPECT_NEAR(variance_of(image), 1e-4, 5e-4 * std::sqrt(2 / 9e4));
    double neighbours = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 1; x < image.width; ++x) neighbours += (image(x, y) - 1) * (image(x - 1, y) - 1);
    }
    EXPECT_NEAR(neighbours / 9e4 / 1e-4, 0, 5 / 300.0);
}

TEST(XrayDetector, CountsAreWholeSaturateAndHaveAFloor) {
    XrayModel model;
    model.bits = 10;
    model.full_scale = 0.5;
    model.floor_share = 0.1;
    const auto count = [&](float water) { return detected(model, expose_paths(model, slab(water)), 1).image(4, 4); };
    EXPECT_EQ(count(0), 1023) << "air saturates";
    EXPECT_EQ(count(0.69F), 1023);
    EXPECT_EQ(count(2), std::round(1023 * (0.1 + 0.9 * std::exp(-2.0) / 0.5)));
    EXPECT_EQ(count(50), std::round(102.3));
    const RawXray raw = detected(model, expose_paths(model, slab(1)), 1);
    EXPECT_TRUE(raw.integer_pixels);
    EXPECT_EQ(raw.max_representable, 1023);
}

TEST(XrayDetector, VignettingTakesLightFromTheCorners) {
    XrayModel model;
    model.vignetting = 0.3;
    const Image image = detected(model, expose_paths(model, slab(0, 0, 400)), 1).image;
    EXPECT_NEAR(image(0, 0), 0.7, 0.005);
    EXPECT_NEAR(image(100, 100), 1, 1e-4);
    EXPECT_NEAR(image(0, 100), 0.85, 0.005);
}

TEST(XrayDetector, SameSeedSameCounts) {
    const XrayModel& model = xray_model("c-arm");
    const XrayExposure exposure = expose_paths(model, slab(3));
    EXPECT_EQ(detected(model, exposure, 3).image.pixels, detected(model, exposure, 3).image.pixels);
    EXPECT_NE(detected(model, exposure, 3).image.pixels, detected(model, exposure, 4).image.pixels);
}

TEST(Expose, IdealXraysAreTheDrrOnFinerSamples) {
    const Volume spine = test::spine_volume(40);
    const std::vector<View> views = test::biplane_views(64);
    const auto backend = create_backend("reference").backend;
    const auto exposures = expose(XrayModel{}, spine, hu_presets().front(), views, test::oblique_pose(), *backend);
    ASSERT_EQ(exposures.size(), 2U);
    const auto session = backend->prepare({spine, views, {Projector::joseph, {}}, {}});
    for (std::size_t v = 0; v < 2; ++v) {
        const Image drr = session->render(test::oblique_pose(), v);
        const Image seen = detected(XrayModel{}, exposures[v], 1).image;
        ASSERT_EQ(seen.width, drr.width);
        double worst = 0;
        Eigen::Vector3d drr_sums = Eigen::Vector3d::Zero(), seen_sums = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < drr.pixels.size(); ++i) {
            const double integral = -std::log(seen.pixels[i]);
            worst = std::max(worst, std::abs(integral - drr.pixels[i]));
            const Eigen::Vector3d place(1, static_cast<double>(i % 64), static_cast<double>(i / 64));
            drr_sums += drr.pixels[i] * place;
            seen_sums += integral * place;
        }
        const float largest = *std::ranges::max_element(drr.pixels);
        EXPECT_LT(worst, 0.12 * largest) << "pixels against rays through their centres, at edges";
        EXPECT_NEAR(seen_sums[0] / drr_sums[0], 1, 0.005);
        EXPECT_NEAR(seen_sums[1] / seen_sums[0], drr_sums[1] / drr_sums[0], 0.03) << "[px]: in place";
        EXPECT_NEAR(seen_sums[2] / seen_sums[0], drr_sums[2] / drr_sums[0], 0.03);
    }
}

TEST(Expose, RefusesACameraWithoutDetector) {
    std::vector<View> views = test::biplane_views(16);
    views[1].geometry.camera.sdd_mm.reset();
    const auto backend = create_backend("reference").backend;
    EXPECT_THAT(test::error_of([&] {
                    (void)expose(XrayModel{}, test::spine_volume(8), hu_presets().front(), views, {}, *backend);
                }),
                HasSubstr("its camera has no sdd"));
    XrayModel bad;
    bad.ramp = 2;
    EXPECT_THAT(test::error_of([&] {
                    (void)expose(bad, test::spine_volume(8), hu_presets().front(), test::biplane_views(16), {},
                                 *backend);
                }),
                HasSubstr("ramp = 2 in X-ray model ideal: must be in [0, 1]"));
}

}  // namespace
}  // namespace raylign::detail
