#include "apps/viewer/embedded.h"

#include <gtest/gtest.h>

#include "apps/viewer/packed.h"
#include "tests/support/errors.h"

namespace raylign::detail::apps {
namespace {

Volume empty_volume(const Eigen::Vector3i& size) {
    Volume volume;
    volume.grid.size = size;
    volume.grid.spacing_mm = {1, 2, 3};
    volume.attenuation_per_mm.resize(static_cast<std::size_t>(volume.grid.voxel_count()));
    return volume;
}

TEST(EmbeddedVolume, IsCroppedToWhatIsNotAirAndStaysInItsPlace) {
    Volume volume = empty_volume({20, 10, 10});
    volume.attenuation_per_mm[volume.index(5, 4, 3)] = 0.05F;
    volume.attenuation_per_mm[volume.index(8, 4, 3)] = 0.02F;
    const EmbeddedVolume result = embedded(volume);
    EXPECT_EQ(result.grid.size, Eigen::Vector3i(4, 1, 1));
    EXPECT_EQ(result.grid.origin_mm, Eigen::Vector3d(5, 8, 9));
    EXPECT_EQ(result.values, (std::vector<std::uint8_t>{255, 0, 0, 102}));
    EXPECT_EQ(result.halvings, 0);
    EXPECT_EQ(result.clipped_share, 0);
    // Weights 255 and 102 at x = 5 and 8 mm.
    EXPECT_NEAR(result.centre_ct_mm.x(), 5 + 3 * 102. / 357, 1e-12);
    EXPECT_NEAR(result.radius_mm, 3 * std::sqrt(255. * 102) / 357, 1e-12);
}

TEST(EmbeddedVolume, IsHalvedUntilItFitsAndKeepsItsPlace) {
    Volume volume = empty_volume({321, 4, 4});
    std::ranges::fill(volume.attenuation_per_mm, 0.02F);
    const EmbeddedVolume result = embedded(volume);
    EXPECT_EQ(result.halvings, 2);
    EXPECT_EQ(result.grid.size, Eigen::Vector3i(81, 1, 1));
    EXPECT_EQ(result.grid.spacing_mm, Eigen::Vector3d(4, 8, 12));
    EXPECT_EQ(result.grid.origin_mm, Eigen::Vector3d(1.5, 3, 4.5));
}

TEST(EmbeddedVolume, ALittleMetalDoesNotTakeTheGreyValuesOfBone) {
    Volume volume = empty_volume({60, 60, 60});
    std::ranges::fill(volume.attenuation_per_mm, 0.05F);
    for (int x = 20; x < 25; ++x) volume.attenuation_per_mm[volume.index(x, 30, 30)] = 2;
    const EmbeddedVolume result = embedded(volume);
    EXPECT_NEAR(result.white_per_mm, 0.1, 1e-6);
    EXPECT_EQ(result.values[0], 128);
    EXPECT_NEAR(result.clipped_share, 5 / 216000., 1e-12);
}

TEST(EmbeddedVolume, RefusesOneThatShowsNothing) {
    Volume volume = empty_volume({3, 3, 3});
    volume.attenuation_per_mm[13] = -1;
    EXPECT_THROW((void)embedded(volume), Error);
}

TEST(EmbeddedView, IsHalvedWithItsCamera) {
    View view;
    view.geometry.camera.size_px = {1300, 700};
    view.geometry.camera.intrinsics_px(0, 2) = 100.5;
    const EmbeddedView result = embedded(view);
    EXPECT_EQ(result.halvings, 2);
    EXPECT_EQ(result.view.geometry.camera.size_px, Eigen::Vector2i(325, 175));
    EXPECT_NEAR(result.view.geometry.camera.intrinsics_px(0, 2), (100.5 - 1.5) / 4, 1e-12);
    EXPECT_TRUE(result.view.image.empty());
}

TEST(Packed, IsZlibInBase64) {
    const std::vector<std::uint8_t> bytes(1000, 7);
    const std::string text = packed(bytes);
    EXPECT_EQ(text.substr(0, 2), "eJ");  // 0x78 0x9c: RFC 1950, window of 32 KiB
    EXPECT_LT(text.size(), 40U);
}

}  // namespace
}  // namespace raylign::detail::apps
