#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/volume.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::MetaText;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

/// 4 x 3 x 2 voxels of 1 mm at (1, 2, 3); HU -1000 but for a few.
class ObjectRegionTest : public test::IoTest {
protected:
    void SetUp() override {
        IoTest::SetUp();
        std::vector<std::int16_t> hu(24, -1000);
        hu[at_voxel(1, 1, 0)] = 300;
        hu[at_voxel(2, 1, 0)] = 900;
        hu[at_voxel(3, 2, 1)] = 3000;
        hu[at_voxel(0, 0, 0)] = 40;
        ct_ = write("ct.mha", MetaText{.dims = "4 3 2", .spacing = "1 1 1"}.with(test::bytes_of(hu)));
    }
    static std::size_t at_voxel(int x, int y, int z) { return static_cast<std::size_t>((z * 3 + y) * 4 + x); }

    [[nodiscard]] std::filesystem::path labels(const std::vector<std::int16_t>& values) const {
        return write("labels.mha", MetaText{.dims = "4 3 2", .spacing = "1 1 1"}.with(test::bytes_of(values)));
    }
    [[nodiscard]] VolumeFile read(const ObjectRegion& object) const { return read_volume(ct_, {.object = object}); }

    static constexpr double kWater = 0.0193;
    std::filesystem::path ct_;
};

TEST_F(ObjectRegionTest, BoneThresholdKeepsTheContrastOfBoneAndCropsToIt) {
    const VolumeFile file = read({.bone_threshold_hu = 200});
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 2, 2));
    EXPECT_EQ(file.volume.grid.origin_mm, Eigen::Vector3d(2, 3, 3));
    EXPECT_NEAR(file.volume(0, 0, 0), kWater * 0.1, 1e-8);  // 300 HU exceed 200 by 100
    EXPECT_EQ(file.volume(0, 1, 0), 0);
    EXPECT_THAT(file.notes, Contains(HasSubstr("exceed 200 HU")));
    EXPECT_THAT(file.notes, Contains(HasSubstr("3 x 2 x 2 of 4 x 3 x 2 voxels")));
}

TEST_F(ObjectRegionTest, MetalIsClipped) {
    const VolumeFile file = read({.clip_hu = 1000});
    EXPECT_FLOAT_EQ(file.volume(3, 2, 1), static_cast<float>(kWater * 2));
    EXPECT_FLOAT_EQ(file.volume(2, 1, 0), static_cast<float>(kWater * 1.9));
}

TEST_F(ObjectRegionTest, OneBoneOutOfMany) {
    std::vector<std::int16_t> values(24);
    values[at_voxel(1, 1, 0)] = values[at_voxel(2, 1, 0)] = 7;
    values[at_voxel(3, 2, 1)] = 8;
    const VolumeFile file = read({.label_map = labels(values), .labels = {7}});
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(2, 1, 1));
    EXPECT_EQ(file.volume.grid.origin_mm, Eigen::Vector3d(2, 3, 3));
    EXPECT_THAT(file.notes, Contains(HasSubstr("label 7")));
    EXPECT_THAT(file.files, Contains(at("labels.mha")));
    EXPECT_EQ(read({.label_map = at("labels.mha")}).volume.grid.size, Eigen::Vector3i(3, 2, 2));  // all but 0
    EXPECT_THAT(error_of([&] { (void)read({.label_map = at("labels.mha"), .labels = {9}}); }),
                AllOf(HasSubstr("labels.mha"), HasSubstr("label = 9"), HasSubstr("7, 8")));
}

TEST_F(ObjectRegionTest, BoxInMillimetresAndInVoxels) {
    const VolumeFile mm = read({.box_mm = CtBox{{1.5, 2.5, 2.5}, {2.5, 3.5, 3.5}}});
    EXPECT_EQ(mm.volume.grid.size, Eigen::Vector3i(1, 1, 1));
    EXPECT_EQ(mm.volume.grid.origin_mm, Eigen::Vector3d(2, 3, 3));
    EXPECT_THAT(mm.notes, Contains(HasSubstr("fades out")));
    const VolumeFile far = read({.box_mm = CtBox{{-10, -10, -10}, {20, 20, 20}}});  // its faces cut nothing
    EXPECT_FLOAT_EQ(far.volume(1, 1, 0), static_cast<float>(kWater * 1.3));
    const VolumeFile voxels = read({.box_voxels = VoxelBox{{1, 1, 0}, {4, 2, 1}}});
    EXPECT_EQ(voxels.volume.grid.size, Eigen::Vector3i(2, 1, 1));
    EXPECT_THROW((void)read({.box_voxels = VoxelBox{{1, 1, 0}, {5, 2, 1}}}), Error);
}

TEST_F(ObjectRegionTest, WhereNothingIsLeftTheStepIsNamed) {
    EXPECT_THAT(error_of([&] { (void)read({.bone_threshold_hu = 3500}); }), HasSubstr("after the bone threshold"));
    EXPECT_THAT(error_of([&] {
                    (void)read({.box_mm = CtBox{{1, 4, 3}, {2, 4, 3}}});
                }),
                HasSubstr("after keeping the box"));
    EXPECT_THAT(error_of([&] { (void)read({.bone_threshold_hu = -950}); }), HasSubstr("cut-off"));
    std::vector<std::int16_t> values(24);
    values[at_voxel(0, 2, 1)] = 1;
    EXPECT_THAT(error_of([&] { (void)read({.label_map = labels(values)}); }), HasSubstr("after keeping the label"));
    EXPECT_THAT(error_of([&] { (void)read({.label_map = labels(std::vector<std::int16_t>(24))}); }),
                HasSubstr("0 everywhere"));
}

TEST_F(ObjectRegionTest, FractionsAreNoLabels) {
    const std::vector<float> values(24, 0.5F);
    const auto path =
        write("l.mha", MetaText{.dims = "4 3 2", .spacing = "1 1 1", .type = "MET_FLOAT"}.with(test::bytes_of(values)));
    EXPECT_THAT(error_of([&] { (void)read({.label_map = path}); }), HasSubstr("whole number"));
}

TEST_F(ObjectRegionTest, RealPelvisSeriesAndObliqueHeadLoseNothingButSpace) {
    const auto pelvis = test::test_data() / "pelvis" / "dicom",
               oblique = test::test_data() / "oblique" / "CT_pitch.nii.gz";
    RAYLIGN_NEED_DATA(pelvis);
    RAYLIGN_NEED_DATA(oblique);
    const Volume whole = read_volume(pelvis).volume;
    const Volume bone = read_volume(pelvis, {.object = {.bone_threshold_hu = 300}}).volume;
    EXPECT_LT(bone.attenuation_per_mm.size(), whole.attenuation_per_mm.size() * 2 / 3);
    // Every voxel of bone is where it was.
    int checked = 0;
    for (int z = 0; z < bone.grid.size.z(); z += 5) {
        for (int y = 0; y < bone.grid.size.y(); y += 7) {
            for (int x = 0; x < bone.grid.size.x(); x += 7) {
                if (bone(x, y, z) == 0) continue;
                const Eigen::Vector3d at = whole.grid.voxel_from_ct(bone.grid.ct_from_voxel(Eigen::Vector3d(x, y, z)));
                const Eigen::Vector3i voxel = at.array().round().cast<int>();
                ASSERT_LT((at - voxel.cast<double>()).norm(), 1e-6);
                ASSERT_NEAR(whole(voxel.x(), voxel.y(), voxel.z()) - 0.0193 * 1.3, bone(x, y, z), 1e-7);
                ++checked;
            }
        }
    }
    EXPECT_GT(checked, 100);
    const Volume head = read_volume(oblique).volume;
    const Eigen::Vector3d middle = head.grid.centre_ct_mm();
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(20);
    const Volume part = read_volume(oblique, {.object = {.box_mm = CtBox{middle - half, middle + half}}}).volume;
    EXPECT_LT((part.grid.direction - head.grid.direction).norm(), 1e-12);
    EXPECT_LT((part.grid.centre_ct_mm() - middle).norm(), 6);
    EXPECT_LT(part.grid.voxel_count(), head.grid.voxel_count() / 10);
}

}  // namespace
}  // namespace raylign::detail
