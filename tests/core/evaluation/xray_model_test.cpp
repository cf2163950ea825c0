#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/evaluation/xray_parts.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

using testing::HasSubstr;

TEST(XrayModel, PresetsAreFoundByNameAndKeepTheirOwnRanges) {
    ASSERT_EQ(xray_models().size(), 4U);
    EXPECT_EQ(xray_models().front().name, "ideal");
    for (const char* name : {"ideal", "c-arm", "biplane-lab", "flat-panel"}) {
        EXPECT_EQ(xray_model(name).name, name);
        EXPECT_FALSE(xray_model(name).source.empty()) << name;
        EXPECT_NO_THROW(check_xray_model(xray_model(name), name));
    }
    EXPECT_THAT(test::error_of([] { (void)xray_model("C-arm"); }),
                HasSubstr("X-ray model = C-arm: must be one of ideal, c-arm, biplane-lab, flat-panel"));
}

TEST(XrayModel, RefusesValuesOutOfRangeByName) {
    const double nan = std::nan("");
    const std::vector<std::pair<std::function<void(XrayModel&)>, std::string>> faults{
        {[](XrayModel& m) { m.spectrum.clear(); }, "spectrum = no energies in job: must be at least one energy"},
        {[](XrayModel& m) { m.spectrum[0].energy_kev = -60; },
         "spectrum[0].energy_kev = -60 in job: must be in [10, 150]"},
        {[=](XrayModel& m) { m.spectrum[0].energy_kev = nan; }, "spectrum[0].energy_kev"},
        {[](XrayModel& m) {
             m.spectrum = {{40, 0.5}, {60, -0.5}};
         },
         "spectrum[1].weight = -0.5"},
        {[=](XrayModel& m) { m.spectrum[0].weight = nan; }, "spectrum[0].weight"},
        {[](XrayModel& m) {
             m.spectrum = {{40, 0.5}, {60, 0.4}};
         },
         "sum of the spectrum's weights = 0.9 in job"},
        {[](XrayModel& m) { m.photons_per_mm2 = 0.5; }, "photons_per_mm2 = 0.5 in job: must be 0 or in [1, 1e+09]"},
        {[](XrayModel& m) { m.scatter_ratio = -0.1; }, "scatter_ratio = -0.1 in job: must be in [0, 5]"},
        {[](XrayModel& m) { m.scatter_far_share = 1.1; }, "scatter_far_share = 1.1"},
        {[](XrayModel& m) { m.scatter_near_mm = 0; }, "scatter_near_mm = 0"},
        {[=](XrayModel& m) { m.blade_share.y() = nan; }, "blade_share.y"},
        {[](XrayModel& m) { m.round_field_share = 0.1; }, "round_field_share = 0.1 in job: must be 0 or in [0.5, 1.5]"},
        {[](XrayModel& m) { m.blur_mm = -1; }, "blur_mm = -1"},
        {[](XrayModel& m) { m.vignetting = 1; }, "vignetting = 1"},
        {[](XrayModel& m) { m.bits = 4, m.full_scale = 1; }, "bits = 4 in job: must be 0 or in [8, 16]"},
        {[](XrayModel& m) { m.bits = 8; }, "full_scale = 0 in job: must be in [0.05, 20]"},
    };
    for (const auto& [fault, words] : faults) {
        XrayModel model;
        fault(model);
        EXPECT_THAT(test::error_of([&] { check_xray_model(model, "job"); }), HasSubstr(words));
    }
}

TEST(XrayModel, BlurLeavesATenthAtItsFrequency) {
    for (const double f : {0.8, 1.0, 3.0}) {
        const double sigma = blur_from_mtf10_mm(f);
        EXPECT_NEAR(std::exp(-2 * std::pow(std::numbers::pi * sigma * f, 2)), 0.1, 1e-12);
    }
    EXPECT_THAT(test::error_of([] { (void)blur_from_mtf10_mm(0); }), HasSubstr("cycles/mm: must be positive"));
}

TEST(XrayMaterials, AttenuationIsTheTablesAndFallsBetween) {
    EXPECT_NEAR(mass_attenuation_cm2_per_g(BodyMaterial::water, 60), 0.2059, 1e-12);
    EXPECT_NEAR(mass_attenuation_cm2_per_g(BodyMaterial::cortical_bone, 30), 1.331, 1e-12);
    EXPECT_NEAR(mass_attenuation_cm2_per_g(BodyMaterial::water, 10), 5.329, 1e-12);
    EXPECT_NEAR(mass_attenuation_cm2_per_g(BodyMaterial::water, 150), 0.1505, 1e-12);
    // The default HU preset's own water, by another interpolation of the same table.
    EXPECT_NEAR(mass_attenuation_cm2_per_g(BodyMaterial::water, 70) / 10, hu_presets().front().water_per_mm, 1e-4);
}

Volume row_of_voxels(const std::vector<float>& attenuation_per_mm) {
    Volume volume;
    volume.grid.size = {static_cast<int>(attenuation_per_mm.size()), 1, 1};
    volume.attenuation_per_mm = attenuation_per_mm;
    return volume;
}

TEST(XrayMaterials, SoftTissueIsWaterAndMetalIsDenseBone) {
    const HuPreset& units = hu_presets().front();
    const auto water = static_cast<float>(units.water_per_mm), soft = 1.06F * water;
    const double ratio = 1.92 * mass_attenuation_cm2_per_g(BodyMaterial::cortical_bone, 70) /
                         mass_attenuation_cm2_per_g(BodyMaterial::water, 70);
    const auto bone = static_cast<float>(ratio * water), metal = 0.25F;
    const Volume volume = row_of_voxels({0, 0.3F * water, water, soft, (soft + bone) / 2, bone, metal});
    const MaterialVolumes parts = split_materials(volume, units);
    const std::vector<float> in_water{0, 0.3F * water, water, soft, soft / 2, 0, 0};
    const std::vector<float> in_bone{0, 0, 0, 0, bone / 2, bone, metal};
    EXPECT_THAT(parts.water.attenuation_per_mm, testing::Pointwise(testing::FloatNear(1e-7F), in_water));
    EXPECT_THAT(parts.bone.attenuation_per_mm, testing::Pointwise(testing::FloatNear(1e-7F), in_bone));
}

TEST(XrayBlur, KeepsMeanAndHasItsWidth) {
    EXPECT_NEAR(blurred(Image(9, 7, 0.7F), {1.3, 0})(0, 0), 0.7, 1e-6);
    Image dot(101, 81);
    dot(50, 40) = 1;
    const Image spread = blurred(dot, {4, 2});
    double sum = 0, xx = 0, yy = 0;
    for (int y = 0; y < 81; ++y) {
        for (int x = 0; x < 101; ++x) {
            sum += spread(x, y);
            xx += (x - 50) * (x - 50) * spread(x, y);
            yy += (y - 40) * (y - 40) * spread(x, y);
        }
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    EXPECT_NEAR(xx, 16 + 1.0 / 12, 0.03) << "sigma^2 and the pixel's own width";
    EXPECT_NEAR(yy, 4 + 1.0 / 12, 0.03);
    EXPECT_EQ(blurred(dot, {0, 0}).pixels, dot.pixels);
}

TEST(XrayBlur, SpreadingKeepsTheSumInsideAndLosesItOutside) {
    const auto sum_of = [](const Image& image) {
        double sum = 0;
        for (const float value : image.pixels) sum += value;
        return sum;
    };
    Image dot(201, 201);
    dot(100, 100) = 1;
    EXPECT_NEAR(sum_of(spread_out(dot, 15)), 1, 1e-4);
    Image corner(201, 201);
    corner(0, 0) = 1;
    EXPECT_NEAR(sum_of(spread_out(corner, 15)), 0.25, 0.02) << "a quarter stays, and half of the pixel's own row";
}

TEST(XrayBlur, BinsAreMeans) {
    Image samples(4, 2);
    samples.pixels = {1, 2, 5, 5, 3, 6, 5, 5};
    EXPECT_THAT(binned(samples, 2).pixels, testing::ElementsAre(3, 5));
}

}  // namespace
}  // namespace raylign::detail
