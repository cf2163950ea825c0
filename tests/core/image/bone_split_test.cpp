#include "core/image/bone_split.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

constexpr float kBone = 0.05F;
const BoneSplitOptions kOptions{0.03F, 2, 3000, 1500};

/// Air, 60 x 40 x 60 voxels of 1.5 mm about the origin.
Volume air() {
    Volume volume;
    volume.grid = {{60, 40, 60}, {1.5, 1.5, 1.5}, {-44.25, -29.25, -44.25}};
    volume.attenuation_per_mm.assign(60UL * 40 * 60, 0);
    return volume;
}

void put_box(Volume& volume, const Eigen::Vector3i& begin, const Eigen::Vector3i& end, float value = kBone) {
    for (int z = begin.z(); z < end.z(); ++z) {
        for (int y = begin.y(); y < end.y(); ++y) {
            for (int x = begin.x(); x < end.x(); ++x) {
                volume.attenuation_per_mm[(static_cast<std::size_t>(z) * 40 + y) * 60 + x] = value;
            }
        }
    }
}

std::int32_t label_at(const BoneSplit& split, int x, int y, int z) {
    return split.map.labels[(static_cast<std::size_t>(z) * 40 + y) * 60 + x];
}

/// Two shafts with marrow that a thin bridge joins, and a bone across the middle above them.
Volume legs() {
    Volume volume = air();
    for (const int x : {6, 38}) {
        put_box(volume, {x, 10, 2}, {x + 16, 26, 30});
        put_box(volume, {x + 3, 13, 0}, {x + 13, 23, 40}, 0);  // open at both ends: a tube
    }
    put_box(volume, {22, 17, 10}, {38, 19, 12});
    put_box(volume, {14, 10, 40}, {46, 26, 54});
    return volume;
}

}  // namespace

TEST(BoneSplit, TellsBonesApartThatTouchAndNamesThemByPlace) {
    const BoneSplit split = split_bones(legs(), kOptions);
    ASSERT_EQ(split.bones.size(), 3U);
    EXPECT_EQ(split.bones[0].name, "middle_1");
    const std::int32_t right = label_at(split, 7, 11, 20), left = label_at(split, 52, 11, 20);
    EXPECT_EQ(split.bones[right - 1].name, "right_1");  // x grows to the patient's left
    EXPECT_EQ(split.bones[left - 1].name, "left_1");
    EXPECT_EQ(label_at(split, 30, 12, 50), 1);
    EXPECT_EQ(label_at(split, 24, 17, 10), right);  // half of the bridge
    EXPECT_EQ(label_at(split, 36, 17, 10), left);
    EXPECT_EQ(label_at(split, 30, 30, 10), 0);
}

TEST(BoneSplit, MarrowBelongsToItsBone) {
    const BoneSplit split = split_bones(legs(), kOptions);
    EXPECT_EQ(label_at(split, 14, 18, 20), label_at(split, 7, 11, 20));
    EXPECT_NEAR(split.bones[0].volume_mm3, 32 * 16 * 14 * 3.375, 1e-6);
}

TEST(BoneSplit, ALargeHoleIsNone) {
    BoneSplitOptions narrow = kOptions;
    narrow.hole_mm2 = 100;  // the marrow has 225
    narrow.opening_mm = 1.5;
    const BoneSplit split = split_bones(legs(), narrow);
    EXPECT_EQ(label_at(split, 14, 18, 20), 0);
}

TEST(BoneSplit, NoBoneIsAnError) {
    Volume volume = air();
    put_box(volume, {10, 10, 10}, {18, 18, 18});  // 1.7 cm3
    EXPECT_NE(test::error_of([&] { (void)split_bones(volume, kOptions); }).find("no bone of at least 3 cm3"),
              std::string::npos);
}

}  // namespace raylign::detail
