#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "raylign/io/volume.h"
#include "tests/support/errors.h"
#include "tests/support/test_data.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// Files that broke earlier versions: ../shared/cases, whose README.md says what should become of each.
std::filesystem::path cases() { return test_data().parent_path() / "cases"; }

void expect_same_place(const VoxelGrid& grid, const VoxelGrid& other) {
    EXPECT_EQ(grid.size, other.size);
    EXPECT_LT((grid.centre_ct_mm() - other.centre_ct_mm()).norm(), 0.02) << grid.centre_ct_mm().transpose();
    EXPECT_LT((grid.spacing_mm - other.spacing_mm).norm(), 0.01) << grid.spacing_mm.transpose();
    EXPECT_LT((grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

std::string joined_notes(const std::vector<std::string>& notes) {
    std::string all;
    for (const std::string& note : notes) all += note + "\n";
    return all;
}

struct PlacedCase {
    const char* name;
    const char* note;  ///< words that a note must have
};

TEST(Cases, VolumesLieWhereTheirHeadersSay) {
    RAYLIGN_NEED_DATA(cases());
    const VoxelGrid baseline = read_volume(cases() / "a_mm.nii").volume.grid;
    EXPECT_EQ(baseline.size, Eigen::Vector3i(20, 20, 20));
    EXPECT_LT((baseline.spacing_mm - Eigen::Vector3d(4, 4, 4)).norm(), 1e-6);
    for (const PlacedCase& one : {PlacedCase{"b_metre.nii", "metres"}, PlacedCase{"d_conflict.nii", "sform"},
                                  PlacedCase{"f_shear.nii", "right angles"}, PlacedCase{"g_spix.nii", "sform"},
                                  PlacedCase{"m_cm.mha", "cm"}, PlacedCase{"n_cm.nrrd", "cm"},
                                  PlacedCase{"w_hdrsz.mha", ""}, PlacedCase{"w_slope.mha", "stored \\* 2 \\+ 100"}}) {
        SCOPED_TRACE(one.name);
        const VolumeFile file = read_volume(cases() / one.name);
        expect_same_place(file.volume.grid, baseline);
        EXPECT_THAT(joined_notes(file.notes), ContainsRegex(one.note));
    }
}

struct RefusedCase {
    const char* name;
    const char* words;  ///< a pattern for the message
};

/// Refused in words: the file's name, and nothing of a library's inside.
void expect_refused(const RefusedCase& one, const std::function<void(const std::filesystem::path&)>& read) {
    SCOPED_TRACE(one.name);
    const std::string message = error_of([&] { read(cases() / one.name); });
    EXPECT_THAT(message, AllOf(HasSubstr(one.name), ContainsRegex(one.words)));
    EXPECT_THAT(message, Not(ContainsRegex("std::|itk::|json\\.exception|basic_string|_M_|gdcm")));
}

TEST(Cases, VolumesThatCannotBeReadAreErrors) {
    RAYLIGN_NEED_DATA(cases());
    for (const RefusedCase& one : {RefusedCase{"v_scan.nrrd", "scanner-xyz"},
                                   {"n20.mha", "NDims"},
                                   {"ndims_minus1.mha", "NDims"},
                                   {"fmt_s.mhd", "pattern"},
                                   {"fmt_wide.mhd", "pattern"},
                                   {"nii_vnl_abort.nii", "srow"},
                                   {"nii_vox_offset_ub.nii", "vox_offset"},
                                   {"list_blank_line.mhd", "15 files.*16"},
                                   {"list_10_of_16.mhd", "10 files.*16"},
                                   {"pattern_10_of_16.mhd", "10 files.*16"},
                                   {"pattern_every_2nd.mhd", "8 files.*16"}}) {
        expect_refused(one, [](const auto& path) { (void)read_volume(path); });
    }
}

TEST(Cases, ImagesThatCannotBeReadAreErrors) {
    RAYLIGN_NEED_DATA(cases());
    for (const RefusedCase& one : {RefusedCase{"png_abort.png", "damaged|cut"},
                                   {"tiff_wrap.tif", "size"},
                                   {"tiff_8GB_of_200_bytes.tif", "8589934592 bytes"},
                                   {"tiff_tile_4GB.tif", "4294967296 bytes"},
                                   {"frames_50000000.dcm", "[Ff]rame|pixel"},
                                   {"j2k_64_in_32.dcm", "64|CT"},
                                   {"dicompix_crash.dcm", "."}}) {
        expect_refused(one, [](const auto& path) { (void)read_xray(path); });
    }
}

TEST(Cases, AnOrientationIsToldAndNotApplied) {
    RAYLIGN_NEED_DATA(cases());
    EXPECT_THAT(joined_notes(read_xray(cases() / "o4.tif").notes),
                AllOf(HasSubstr("Orientation 4"), HasSubstr("flip")));
}

TEST(Cases, DistortionIsSeenInEveryGeometry) {
    RAYLIGN_NEED_DATA(cases());
    expect_refused({"maya_ud.txt", "undistorted"}, [](const auto& path) { (void)read_geometry(path); });
    GeometryHints raw;
    raw.undistorted = false;
    EXPECT_TRUE(read_geometry(cases() / "maya_ud.txt", raw).front().distortion);
    EXPECT_TRUE(read_geometry(cases() / "ros.yml").front().distortion);
    const std::vector<GeometryView> pair = read_geometry(cases() / "stereo.yml");
    ASSERT_EQ(pair.size(), 2U);
    EXPECT_TRUE(pair[0].distortion && pair[1].distortion);
    // Camera 1 is the world; x_2 = R x_1 + T of the file.
    EXPECT_LT(source_world_mm(pair[0].geometry).norm(), 1e-9);
    EXPECT_LT((source_world_mm(pair[1].geometry) - Eigen::Vector3d(-900, 0, 900)).norm(), 1e-9);
}

TEST(Cases, TransformsAreRigidPosesOrErrors) {
    RAYLIGN_NEED_DATA(cases());
    for (const RefusedCase& one : {RefusedCase{"translation_0.tfm", "= 0 .*must be 3"},
                                   {"translation_1.tfm", "= 1 .*must be 3"},
                                   {"euler_2.tfm", "= 2 .*must be 6"},
                                   {"quaternion_1.tfm", "= 1 .*must be 7"}}) {
        expect_refused(one, [](const auto& path) { (void)read_pose(path); });
    }
    EXPECT_LT((read_pose(cases() / "mo.tfm").translation_mm - Eigen::Vector3d(-10, 0, 0)).norm(), 1e-9);
    for (const char* name : {"comp.tfm", "two.tfm"}) {  // ct_from_world: shifted by 10 along x, after a turn about z
        const RigidTransform world_from_ct = read_pose(cases() / name);
        const Eigen::Vector3d turned = inverse(world_from_ct) * Eigen::Vector3d(0, 0, 0);
        EXPECT_LT((turned - Eigen::Vector3d(10, 0, 0)).norm(), 1e-9) << name;
        EXPECT_NEAR(rotation_angle_rad(world_from_ct), 2 * std::asin(0.2), 1e-9) << name;
    }
}

TEST(Cases, TablesLoseNoRow) {
    RAYLIGN_NEED_DATA(cases());
    expect_refused({"targets_typo.csv", "line 1"}, [](const auto& path) { (void)read_targets(path); });
    expect_refused({"header_short.csv", "line 1"}, [](const auto& path) { (void)read_trajectory(path); });
}

}  // namespace
}  // namespace raylign::detail::test
