#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/volume.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

/// The sform (RAS) and size of a NIfTI file, straight from its bytes.
struct Sform {
    Eigen::Matrix<double, 3, 4> ras_from_voxel;
    Eigen::Vector3i size;
};

Sform sform_of(const std::filesystem::path& path) {
    std::array<char, 348> bytes;
    gzFile file = gzopen(path.c_str(), "rb");
    EXPECT_EQ(gzread(file, bytes.data(), 348), 348);
    gzclose(file);
    Sform sform;
    std::array<std::int16_t, 4> dim;
    std::memcpy(dim.data(), bytes.data() + 40, 8);
    sform.size = {dim[1], dim[2], dim[3]};
    std::array<float, 12> rows;
    std::memcpy(rows.data(), bytes.data() + 280, 48);
    for (int i = 0; i < 12; ++i) sform.ras_from_voxel(i / 4, i % 4) = rows[static_cast<std::size_t>(i)];
    return sform;
}

void expect_placed_by_sform(const VoxelGrid& grid, const Sform& sform) {
    EXPECT_EQ(grid.size, sform.size);
    const Eigen::Vector3d last = (sform.size.array() - 1).cast<double>().matrix();
    for (const Eigen::Vector3d& voxel : {Eigen::Vector3d(0, 0, 0), last, Eigen::Vector3d(last.x(), 0, last.z()),
                                         Eigen::Vector3d(0, last.y(), last.z() / 2)}) {
        const Eigen::Vector3d ras = sform.ras_from_voxel.leftCols<3>() * voxel + sform.ras_from_voxel.col(3);
        const Eigen::Vector3d lps(-ras.x(), -ras.y(), ras.z());
        EXPECT_LT((grid.ct_from_voxel(voxel) - lps).norm(), 1e-3) << voxel.transpose();  // float32 header
    }
}

float attenuation(double hu) { return hu <= -900 ? 0 : static_cast<float>(0.0193 * (1 + hu / 1000)); }

TEST(RealVolume, ObliqueHeadLiesWhereItsSformSays) {
    const auto path = test::test_data() / "oblique" / "CT_pitch.nii.gz";
    RAYLIGN_NEED_DATA(path);
    const VolumeFile file = read_volume(path);
    expect_placed_by_sform(file.volume.grid, sform_of(path));
    EXPECT_GT((file.volume.grid.direction.cwiseAbs() - Eigen::Matrix3d::Identity()).norm(), 0.1) << "not oblique";
    EXPECT_LT(
        (file.volume.grid.direction.transpose() * file.volume.grid.direction - Eigen::Matrix3d::Identity()).norm(),
        1e-12);
}

TEST(RealVolume, PelvisNiftiIsPlacedAndReadInHu) {
    const auto path = test::test_data() / "pelvis" / "example_ct.nii.gz";
    RAYLIGN_NEED_DATA(path);
    const Volume volume = read_volume(path).volume;
    expect_placed_by_sform(volume.grid, sform_of(path));
    EXPECT_LT((volume.grid.spacing_mm - Eigen::Vector3d(3, 3, 3)).norm(), 1e-6);
    EXPECT_FLOAT_EQ(volume(10, 20, 30), attenuation(-132));  // values read from the file's bytes
    EXPECT_FLOAT_EQ(volume(61, 50, 56), attenuation(164));
    EXPECT_FLOAT_EQ(volume(60, 70, 20), attenuation(15));
}

TEST(RealVolume, ChestNiftiIsPlacedAndReadInHu) {
    const auto path = test::test_data() / "chest" / "lidc-0314-half.nii.gz";
    RAYLIGN_NEED_DATA(path);
    const Volume volume = read_volume(path).volume;
    expect_placed_by_sform(volume.grid, sform_of(path));
    EXPECT_LT((volume.grid.spacing_mm - Eigen::Vector3d(1.5625, 1.5625, 2)).norm(), 1e-6);
    EXPECT_FLOAT_EQ(volume(10, 20, 30), 0);  // -996 HU
    EXPECT_FLOAT_EQ(volume(128, 128, 68), attenuation(46));
    EXPECT_FLOAT_EQ(volume(128, 148, 68), attenuation(34));
}

TEST(RealVolume, PelvisDicomIsStackedAndDecodedFromJpeg2000) {
    const auto path = test::test_data() / "pelvis" / "dicom";
    RAYLIGN_NEED_DATA(path);
    const VolumeFile file = read_volume(path);
    const VoxelGrid& grid = file.volume.grid;
    EXPECT_EQ(grid.size, Eigen::Vector3i(512, 512, 20));
    // Slices are 3 mm thick, 2 mm apart.
    EXPECT_LT((grid.spacing_mm - Eigen::Vector3d(0.9765625, 0.9765625, 2)).norm(), 1e-9);
    EXPECT_LT((grid.origin_mm - Eigen::Vector3d(-249.51171875, -437.51171875, -804.5)).norm(), 1e-9);
    EXPECT_EQ(file.files.size(), 20U);
    const auto& voxels = file.volume.attenuation_per_mm;
    EXPECT_EQ(file.volume(0, 0, 10), 0);  // air
    const auto in_tissue =
        std::ranges::count_if(voxels, [](float v) { return v > attenuation(-150) && v < attenuation(150); });
    // Fat and muscle, if HU came out right.
    EXPECT_GT(static_cast<double>(in_tissue) / static_cast<double>(voxels.size()), 0.1);
    EXPECT_GT(*std::ranges::max_element(voxels), attenuation(700));   // cortical bone
    EXPECT_LE(*std::ranges::max_element(voxels), attenuation(3072));  // 12 bits
}

TEST(RealVolume, PelvisDicomSliceCutOffIsRefused) {
    const auto folder = test::test_data() / "pelvis" / "dicom";
    RAYLIGN_NEED_DATA(folder);
    const std::string whole = test::content_of(folder / "CT.1.3.12.2.1107.5.1.4.60064.30000022120808113428000016573");
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "raylign_cut.dcm";
    for (const std::size_t length :
         {std::size_t{140}, std::size_t{1000}, std::size_t{3000}, whole.size() / 2, whole.size() - 10}) {
        std::ofstream(path, std::ios::binary) << whole.substr(0, length);
        EXPECT_THAT(test::error_of([&] { (void)read_xray(path); }), testing::HasSubstr("truncated")) << length;
    }
    std::filesystem::remove(path);
}

TEST(RealVolume, WristCtIsReadAsPagesWithTheGivenSpacing) {
    const auto path = test::test_data() / "wrist" / "rad_dcm_cropped.tif";
    RAYLIGN_NEED_DATA(path);
    const VolumeFile file =
        read_volume(path, {.hu_offset = -1024, .spacing_mm = Eigen::Vector3d(0.39625, 0.39625, 0.625)});
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(68, 86, 128));
    EXPECT_FLOAT_EQ(*std::ranges::max_element(file.volume.attenuation_per_mm), attenuation(4095 - 1024));
    EXPECT_EQ(*std::ranges::min_element(file.volume.attenuation_per_mm), 0);
}

}  // namespace
}  // namespace raylign::detail
