#include "core/io/meshes/material.h"

#include <gmock/gmock.h>

#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

using testing::HasSubstr;

TEST(Material, AlloysAreTheSumOfTheirElements) {
    const HuPreset& kev_60 = hu_preset("water-60kev");
    EXPECT_NEAR(attenuation_of_material("titanium", kev_60), 0.443 * (0.90 * 0.7661 + 0.06 * 0.2778 + 0.04 * 0.8438),
                1e-12);
    EXPECT_NEAR(attenuation_of_material("cobalt-chrome", kev_60),
                0.83 * (0.65 * 1.314 + 0.285 * 0.9639 + 0.065 * 4.274), 1e-12);
    EXPECT_NEAR(attenuation_of_material("bone", kev_60), 0.192 * 0.3148, 1e-12);
    const HuPreset& kev_80 = hu_preset("water-80kev");
    EXPECT_NEAR(attenuation_of_material("polyethylene", kev_80), 0.094 * (0.1437 * 0.3091 + 0.8563 * 0.1610), 1e-12);
    EXPECT_NEAR(attenuation_of_material("steel", kev_80),
                0.8 * (0.66 * 0.5952 + 0.175 * 0.4905 + 0.14 * 0.7306 + 0.025 * 1.962), 1e-12);
}

TEST(Material, BetweenEnergiesOfTheTableItLiesBetween) {
    for (const Material& material : materials()) {
        const double at_70 = attenuation_of_material(material.name, hu_preset("water-70kev"));
        EXPECT_LT(at_70, attenuation_of_material(material.name, hu_preset("water-60kev"))) << material.name;
        EXPECT_GT(at_70, attenuation_of_material(material.name, hu_preset("water-80kev"))) << material.name;
    }
}

TEST(Material, NumbersAreTakenAsTheyAre) {
    const HuPreset& preset = hu_presets().front();
    EXPECT_EQ(attenuation_of_material("MU=0.25", preset), 0.25);
    EXPECT_NEAR(attenuation_of_material("HU=1000", preset), 0.0386, 1e-7);
}

TEST(Material, WhatIsNoneIsRefused) {
    const auto message = [](const char* text) {
        return test::error_of([&] { (void)attenuation_of_material(text, hu_presets().front()); });
    };
    EXPECT_THAT(message("gold"), HasSubstr("cobalt-chrome, titanium, steel, polyethylene, bone, HU=N or MU=N"));
    EXPECT_THAT(message("MU=0"), HasSubstr("(0, 20]"));
    EXPECT_THAT(message("MU=x"), HasSubstr("MU=N"));
    EXPECT_THAT(message("HU=-1000"), HasSubstr("cut-off"));
    EXPECT_THAT(message("HU=nan"), HasSubstr("HU=N"));
}

}  // namespace
}  // namespace raylign::detail
