#include <gmock/gmock.h>
#include <tiffio.h>
#include <zlib.h>

#include <cmath>

#include "core/io/images/raster.h"
#include "io_files.h"
#include "raylign/intensity.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::MetaText;
using test::NiftiBytes;
using testing::HasSubstr;

class VolumeIo : public test::IoTest {};

/// The values of small_hu() by the default preset.
std::vector<float> small_attenuation() {
    std::vector<float> values;
    for (const std::int16_t hu : test::small_hu()) {
        values.push_back(hu <= -900 ? 0 : static_cast<float>(0.0193 * (1 + hu / 1000.0)));
    }
    return values;
}

Volume oblique_volume() {
    Volume volume;
    volume.grid.size = {3, 2, 2};
    volume.grid.spacing_mm = {0.5, 0.75, 2};
    volume.grid.origin_mm = {-10.25, 20.5, 1030};
    const double c = 0.8, s = 0.6;
    volume.grid.direction << c, -s, 0, s, c, 0, 0, 0, 1;
    for (int i = 0; i < 12; ++i) volume.attenuation_per_mm.push_back(0.001F * static_cast<float>(i) + 0.0001234567F);
    return volume;
}

void expect_same_grid(const VoxelGrid& a, const VoxelGrid& b, double tolerance) {
    EXPECT_EQ(a.size, b.size);
    EXPECT_LT((a.spacing_mm - b.spacing_mm).norm(), tolerance);
    EXPECT_LT((a.origin_mm - b.origin_mm).norm(), tolerance);
    EXPECT_LT((a.direction - b.direction).norm(), tolerance);
}

void expect_round_trip(const std::filesystem::path& path, const Volume& volume, double tolerance) {
    write_volume(path, volume);
    const VolumeFile file = read_volume(path, {.is_attenuation = true});
    EXPECT_EQ(file.volume.attenuation_per_mm, volume.attenuation_per_mm);
    expect_same_grid(file.volume.grid, volume.grid, tolerance);
    EXPECT_EQ(file.files, std::vector{path});
}

TEST_F(VolumeIo, MhaRoundTripKeepsVoxelsAndOrientation) { expect_round_trip(at("v.mha"), oblique_volume(), 1e-12); }
TEST_F(VolumeIo, NrrdRoundTripKeepsVoxelsAndOrientation) { expect_round_trip(at("v.nrrd"), oblique_volume(), 1e-12); }
TEST_F(VolumeIo, NiftiRoundTripKeepsVoxelsAndOrientation) { expect_round_trip(at("v.nii"), oblique_volume(), 1e-4); }
TEST_F(VolumeIo, GzippedNiftiRoundTripKeepsVoxelsAndOrientation) {
    expect_round_trip(at("v.nii.gz"), oblique_volume(), 1e-4);
}

TEST_F(VolumeIo, UpperCaseExtensionsAreWrittenAndRead) {
    for (const char* name : {"box.MHA", "box.NRRD", "box.NII", "Box.NII.GZ"}) {
        expect_round_trip(at(name), oblique_volume(), 1e-4);
    }
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 4);
}

TEST_F(VolumeIo, MirroredAxesAreAllowedAndNoted) {
    Volume volume = oblique_volume();
    volume.grid.direction.col(2) *= -1;
    expect_round_trip(at("v.mha"), volume, 1e-12);
    EXPECT_THAT(read_volume(at("v.mha"), {.is_attenuation = true}).notes, testing::Contains(HasSubstr("left-handed")));
}

TEST_F(VolumeIo, FailedWriteLeavesTheOldFileAndNoTemporary) {
    const auto path = write("v.xyz", "old");
    EXPECT_THAT(test::error_of([&] { write_volume(path, oblique_volume()); }), HasSubstr(".mha, .nrrd, .nii"));
    EXPECT_EQ(test::content_of(path), "old");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

TEST_F(VolumeIo, MetaImageHuBecomeAttenuation) {
    const VolumeFile file = read_volume(write("ct.mha", MetaText().with(bytes_of(test::small_hu()))));
    EXPECT_EQ(file.volume.attenuation_per_mm, small_attenuation());
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 2, 2));
    EXPECT_EQ(file.volume.grid.spacing_mm, Eigen::Vector3d(0.5, 0.75, 2));
    EXPECT_EQ(file.volume.grid.origin_mm, Eigen::Vector3d(1, 2, 3));
    EXPECT_THAT(file.notes, testing::Contains(HasSubstr("water-70kev")));
    EXPECT_THAT(file.notes, testing::Contains(HasSubstr("2 voxels at or below -900 HU")));
}

TEST_F(VolumeIo, DetachedMetaImageHeaderIsRead) {
    std::string header = MetaText().with("");
    header.replace(header.find("LOCAL"), 5, "ct.raw");
    (void)write("ct.raw", bytes_of(test::small_hu()));
    EXPECT_EQ(read_volume(write("ct.mhd", header)).volume.attenuation_per_mm, small_attenuation());
}

TEST_F(VolumeIo, NotesShowNoNoiseOfSinglePrecision) {
    std::vector<float> voxels(12, -1000.00006F);
    voxels[3] = 789.0000610351562F;
    const auto path = write("v.mha", MetaText{.type = "MET_FLOAT"}.with(bytes_of(voxels)));
    EXPECT_THAT(read_volume(path).notes, testing::Contains(HasSubstr("stored -1000 to 789, ")));
    voxels[3] = 123456789;
    EXPECT_THAT(read_volume(write("w.mha", MetaText{.type = "MET_FLOAT"}.with(bytes_of(voxels)))).notes,
                testing::Contains(HasSubstr("to 123456792, ")))
        << "whole numbers are shown whole";
}

TEST_F(VolumeIo, NamedPresetIsUsed) {
    const auto path = write("ct.mha", MetaText().with(bytes_of(test::small_hu())));
    EXPECT_FLOAT_EQ(read_volume(path, {.hu_preset = "plastimatch"}).volume(2, 1, 0), 0.022F);
}

TEST_F(VolumeIo, HuOffsetIsAddedFirst) {
    const auto path = write("ct.mha", MetaText().with(bytes_of(std::vector<std::int16_t>(12, 1024))));
    EXPECT_FLOAT_EQ(read_volume(path, {.hu_offset = -1024}).volume(0, 0, 0), 0.0193F);
}

TEST_F(VolumeIo, NiftiIsTurnedFromRasToLps) {
    const VolumeFile file = read_volume(write("ct.nii", NiftiBytes().with(bytes_of(test::small_hu()))));
    EXPECT_EQ(file.volume.attenuation_per_mm, small_attenuation());
    const Eigen::Vector3d x = file.volume.grid.ct_from_voxel({2, 1, 1});
    EXPECT_LT((x - Eigen::Vector3d(-11, -20.75, 32)).norm(), 1e-6);
}

TEST_F(VolumeIo, NiftiWithOneTimePointIsAVolume) {
    NiftiBytes nifti;
    nifti.dim[0] = 4;
    EXPECT_EQ(read_volume(write("ct.nii", nifti.with(bytes_of(test::small_hu())))).volume.grid.size,
              Eigen::Vector3i(3, 2, 2));
}

TEST_F(VolumeIo, MetaImageWithOneTimePointIsAVolume) {
    MetaText meta{.dims = "3 2 2 1", .spacing = "0.5 0.75 2 1", .matrix = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"};
    meta.dimensions = 4;
    EXPECT_EQ(read_volume(write("ct.mha", meta.with(bytes_of(test::small_hu())))).volume.attenuation_per_mm,
              small_attenuation());
}

TEST_F(VolumeIo, NrrdInRasIsTurnedToLps) {
    const std::string header =
        "NRRD0004\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: 3 2 2\n"
        "space directions: (0.5,0,0) (0,0.75,0) (0,0,2)\nkinds: domain domain domain\nendian: little\nencoding: raw\n"
        "space origin: (10,20,30)\n\n";
    const VolumeFile file = read_volume(write("ct.nrrd", header + bytes_of(test::small_hu())));
    EXPECT_EQ(file.volume.attenuation_per_mm, small_attenuation());
    EXPECT_LT((file.volume.grid.ct_from_voxel({2, 1, 1}) - Eigen::Vector3d(-11, -20.75, 32)).norm(), 1e-9);
}

template <typename T>
class VolumePixelTypes : public test::IoTest {};
using PixelTypes = testing::Types<std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, std::uint32_t, std::int32_t,
                                  std::uint64_t, std::int64_t, float, double>;
TYPED_TEST_SUITE(VolumePixelTypes, PixelTypes);

TYPED_TEST(VolumePixelTypes, AreReadAsTheirNumbers) {
    constexpr bool is_float = std::is_floating_point_v<TypeParam>;
    constexpr bool is_signed = std::is_signed_v<TypeParam>;
    const std::string base =
        is_float ? (sizeof(TypeParam) == 4 ? "float" : "double") : "int" + std::to_string(8 * sizeof(TypeParam));
    const std::string type = (is_float || is_signed ? "" : "u") + base;
    const std::string header = "NRRD0004\ntype: " + type + (is_float ? "" : "_t") +
                               "\ndimension: 3\nsizes: 3 2 2\nspacings: 1 1 1\nendian: little\nencoding: raw\n\n";
    std::vector<TypeParam> voxels;
    for (int i = 0; i < 12; ++i) voxels.push_back(static_cast<TypeParam>(i % 10));
    const VolumeFile file = read_volume(this->write("v.nrrd", header + bytes_of(voxels)), {.is_attenuation = true});
    EXPECT_EQ(file.volume.attenuation_per_mm, std::vector<float>(voxels.begin(), voxels.end()));
}

/// Pages of 16-bit grey, the width given per page.
void write_pages(const std::filesystem::path& path, const std::vector<int>& widths) {
    TIFF* file = TIFFOpen(path.c_str(), "w");
    std::uint16_t value = 0;
    for (const int width : widths) {
        TIFFSetField(file, TIFFTAG_IMAGEWIDTH, width);
        TIFFSetField(file, TIFFTAG_IMAGELENGTH, 2);
        TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 16);
        TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
        TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        for (std::uint32_t row = 0; row < 2; ++row) {
            std::vector<std::uint16_t> pixels(static_cast<std::size_t>(width));
            for (std::uint16_t& pixel : pixels) pixel = value++ % 10;
            TIFFWriteScanline(file, pixels.data(), row, 0);
        }
        TIFFWriteDirectory(file);
    }
    TIFFClose(file);
}

TEST_F(VolumeIo, PagesOfATiffAreSlices) {
    write_pages(at("ct.tif"), {3, 3});
    const VolumeFile file = read_volume(at("ct.tif"), {.is_attenuation = true, .spacing_mm = Eigen::Vector3d(1, 2, 3)});
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 2, 2));
    EXPECT_EQ(file.volume.grid.spacing_mm, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(file.volume(1, 0, 1), 7);
    EXPECT_EQ(file.volume(2, 1, 1), 1);
}

TEST_F(VolumeIo, TiffWithoutSpacingNamesTheOption) {
    write_pages(at("ct.tif"), {3, 3});
    EXPECT_THAT(test::error_of([&] { (void)read_volume(at("ct.tif")); }), HasSubstr("--spacing"));
}

TEST_F(VolumeIo, TiffSpacingOutOfRangeIsRefused) {
    write_pages(at("ct.tif"), {3, 3});
    for (const double bad : {0.0, -1.0, 1000.5, std::nan("")}) {
        EXPECT_THAT(
            test::error_of([&] { (void)read_volume(at("ct.tif"), {.spacing_mm = Eigen::Vector3d(1, bad, 3)}); }),
            HasSubstr("must be in (0, 1000] mm"));
    }
}

TEST_F(VolumeIo, TiffPagesOfDifferentSizeAreRefused) {
    write_pages(at("ct.tif"), {3, 4});
    EXPECT_THAT(test::error_of([&] { (void)read_volume(at("ct.tif"), {.spacing_mm = Eigen::Vector3d(1, 2, 3)}); }),
                HasSubstr("page 2"));
}

TEST_F(VolumeIo, TiffOfOnePageIsNoVolume) {
    write_pages(at("ct.tif"), {3});
    EXPECT_THAT(test::error_of([&] { (void)read_volume(at("ct.tif"), {.spacing_mm = Eigen::Vector3d(1, 2, 3)}); }),
                HasSubstr("3-D"));
}

TEST_F(VolumeIo, SpacingForAFileThatStatesItsOwnIsRefused) {
    const auto path = write("ct.mha", MetaText().with(bytes_of(test::small_hu())));
    EXPECT_THAT(test::error_of([&] { (void)read_volume(path, {.spacing_mm = Eigen::Vector3d(1, 1, 1)}); }),
                HasSubstr("--spacing"));
}

}  // namespace
}  // namespace raylign::detail
