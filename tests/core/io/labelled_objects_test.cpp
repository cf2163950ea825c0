#include "core/io/volumes/labelled_objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "io_files.h"
#include "raylign/io/volume.h"
#include "raylign/phantom.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// 10^3 voxels of attenuation 0.02; labels 30 and 31 (L2, L1 of TotalSegmentator) are slabs of two voxels in z with
/// 0.05, label 1 (the spleen) one more, label 75 (a femur) is a single voxel.
struct LabelledCt {
    explicit LabelledCt(const std::string& path) : file(path) {
        ct.grid = centred_grid({10, 10, 10}, {2, 2, 2});
        ct.attenuation_per_mm.assign(1000, 0.02F);
        Volume map{ct.grid, std::vector<float>(1000, 0)};
        for (std::size_t i = 0; i < 1000; ++i) {
            const std::size_t z = i / 100;
            if (z == 2 || z == 3) map.attenuation_per_mm[i] = 30;
            if (z == 5 || z == 6) map.attenuation_per_mm[i] = 31;
            if (z == 8) map.attenuation_per_mm[i] = 1;
            if (map.attenuation_per_mm[i] >= 30) ct.attenuation_per_mm[i] = 0.05F;
        }
        map.attenuation_per_mm[999] = 75;
        write_volume(file, map);
    }
    [[nodiscard]] ObjectCut cut(std::vector<LabelledName> objects) const { return {file, "", std::move(objects)}; }
    [[nodiscard]] std::string error_of(std::vector<LabelledName> objects) const {
        return test::error_of([&] { (void)cut_objects(ct, cut(std::move(objects))); });
    }

    std::string file;
    Volume ct;
};

using LabelledObjectsTest = test::IoTest;

double all_attenuation(const Volume& volume) {
    return std::accumulate(volume.attenuation_per_mm.begin(), volume.attenuation_per_mm.end(), 0.0);
}

}  // namespace

TEST_F(LabelledObjectsTest, AreCutOutByNameAndNumberInTheirPlaces) {
    const LabelledCt labelled(at("bones.mha").string());
    const LabelledObjects found = cut_objects(labelled.ct, labelled.cut({{"L2", {"vertebrae_L2"}}, {"L1", {"31"}}}));
    EXPECT_THAT(found.names, ElementsAre("L2", "L1"));
    EXPECT_FALSE(found.rest);
    for (std::size_t k = 0; k < 2; ++k) {
        const Volume& object = found.objects[k];
        EXPECT_EQ(object.grid.size, Eigen::Vector3i(10, 10, 2));
        EXPECT_NEAR(all_attenuation(object), 200 * 0.05, 1e-4);
        const double z_mm = labelled.ct.grid.ct_from_voxel(Eigen::Vector3d(0, 0, k == 0 ? 2 : 5)).z();
        EXPECT_NEAR(object.grid.origin_mm.z(), z_mm, 1e-9);
    }
}

TEST_F(LabelledObjectsTest, AndTheRestAddUpToTheCt) {
    const LabelledCt labelled(at("bones.mha").string());
    ObjectCut cut = labelled.cut({{"both", {"30", "31"}}});
    cut.above_per_mm = 0.02F;
    cut.with_rest = true;
    const LabelledObjects found = cut_objects(labelled.ct, cut);
    ASSERT_TRUE(found.rest);
    EXPECT_NEAR(all_attenuation(found.objects[0]), 400 * 0.03, 1e-4);
    for (const float voxel : found.rest->attenuation_per_mm) EXPECT_NEAR(voxel, 0.02F, 1e-7);
}

TEST_F(LabelledObjectsTest, AllBonesAreThoseNamedSoAndLargeEnough) {
    const LabelledCt labelled(at("bones.mha").string());
    const LabelledObjects found = cut_objects(labelled.ct, labelled.cut({}));
    EXPECT_THAT(found.names, ElementsAre("vertebrae_L2", "vertebrae_L1"));
    EXPECT_THAT(testing::PrintToString(found.notes), HasSubstr("left out: voxels of an object = 1"));
}

TEST_F(LabelledObjectsTest, BadOnesAreRefusedWithWhatThereIs) {
    const LabelledCt labelled(at("bones.mha").string());
    EXPECT_THAT(labelled.error_of({{"x", {"vertebra_L2"}}}), HasSubstr("did you mean vertebrae_L2?"));
    EXPECT_THAT(labelled.error_of({{"x", {"29"}}}), HasSubstr("30"));
    EXPECT_THAT(labelled.error_of({{"a", {"30"}}, {"b", {"31", "vertebrae_L2"}}}),
                HasSubstr("label vertebrae_L2 is of two objects: a and b"));
    EXPECT_THAT(labelled.error_of({{"a", {"30"}}, {"A", {"31"}}}), HasSubstr("two objects are called A"));
    EXPECT_THAT(labelled.error_of({{"femur", {"75"}}}), HasSubstr("voxels of an object = 1: must be at least 27"));
    EXPECT_THAT(labelled.error_of({{"x", {"30.5"}}}), HasSubstr("label = 30.5"));
}

TEST_F(LabelledObjectsTest, BonesAreToldByTheirNames) {
    for (const char* name : {"vertebrae_L3", "rib_left_1", "Femur left", "hip_right", "skull", "RADIUS"}) {
        EXPECT_TRUE(is_bone_name(name)) << name;
    }
    for (const char* name : {"spleen", "autochthon_left", "gluteus_maximus_left", "heart", "costal_cartilages"}) {
        EXPECT_FALSE(is_bone_name(name)) << name;
    }
}

}  // namespace raylign::detail
