#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::DicomBytes;
using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class Dicom : public test::IoTest {
protected:
    /// Slices of constant value 1024 + z at the given heights, in file names that sort the other way round.
    void write_series(const std::vector<double>& z_mm, DicomBytes dicom = {}) const {
        for (std::size_t i = 0; i < z_mm.size(); ++i) {
            dicom.position = "10\\20\\" + std::to_string(z_mm[i]);
            dicom.instance_uid = dicom.series_uid + "." + std::to_string(i + 1);
            (void)write(dicom.series_uid + "_" + std::to_string(99 - i),
                        dicom.with(std::vector<std::uint16_t>(6, static_cast<std::uint16_t>(1024 + z_mm[i]))));
        }
    }
};

TEST_F(Dicom, SlicesAreSortedByPosition) {
    write_series({4, 0, 2});
    const VolumeFile file = read_volume(folder_);
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 2, 3));
    EXPECT_LT((file.volume.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 2)).norm(), 1e-9);
    EXPECT_LT((file.volume.grid.origin_mm - Eigen::Vector3d(10, 20, 0)).norm(), 1e-9);
    for (int z = 0; z < 3; ++z)
        EXPECT_FLOAT_EQ(file.volume(1, 1, z), static_cast<float>(0.0193 * (1 + 2 * z / 1000.0)));
    EXPECT_EQ(file.files.size(), 3U);
}

TEST_F(Dicom, RescaleIsApplied) {
    write_series({0, 1}, {.slope = "2", .intercept = "-2048"});
    EXPECT_FLOAT_EQ(read_volume(folder_).volume(0, 0, 1), static_cast<float>(0.0193 * (1 + 2 / 1000.0)));
}

TEST_F(Dicom, ObliqueSeriesKeepsItsAxes) {
    DicomBytes dicom{.orientation = "1\\0\\0\\0\\0\\-1"};  // coronal: rows run to the feet
    for (int i = 0; i < 3; ++i) {
        dicom.position = "0\\" + std::to_string(5 * i) + "\\0";
        dicom.instance_uid = "1.2.3.1." + std::to_string(i);
        (void)write(std::to_string(i), dicom.with(std::vector<std::uint16_t>(6, static_cast<std::uint16_t>(1024 + i))));
    }
    const Volume volume = read_volume(folder_).volume;
    EXPECT_LT((volume.grid.ct_from_voxel({1, 1, 2}) - Eigen::Vector3d(0.5, 10, -0.75)).norm(), 1e-9);
    EXPECT_FLOAT_EQ(volume(0, 0, 2), static_cast<float>(0.0193 * 1.002));
}

TEST_F(Dicom, OtherFilesInTheFolderAreIgnoredAndNoted) {
    write_series({0, 1});
    (void)write("readme.txt", "not DICOM");
    (void)write("empty", "");
    const VolumeFile file = read_volume(folder_);
    EXPECT_EQ(file.volume.grid.size.z(), 2);
    EXPECT_THAT(file.notes, Contains(HasSubstr("2 files")));
}

TEST_F(Dicom, TwoSeriesAreListed) {
    write_series({0, 1});
    write_series({0, 1, 2}, {.series_uid = "1.2.3.9", .description = "bone kernel"});
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }),
                AllOf(HasSubstr("--series"), HasSubstr("1: 1.2.3.1 \"small series\", 2 slices"),
                      HasSubstr("2: 1.2.3.9 \"bone kernel\", 3 slices")));
}

TEST_F(Dicom, SeriesIsChosenByUidOrNumber) {
    write_series({0, 1});
    write_series({0, 1, 2}, {.series_uid = "1.2.3.9"});
    EXPECT_EQ(read_volume(folder_, {.series = "1.2.3.9"}).volume.grid.size.z(), 3);
    EXPECT_EQ(read_volume(folder_, {.series = "1"}).volume.grid.size.z(), 2);
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_, {.series = "3"}); }),
                AllOf(HasSubstr("= 3"), HasSubstr("1.2.3.9")));
}

TEST_F(Dicom, MissingSliceSaysWhere) {
    write_series({0, 2, 4, 8, 10});
    EXPECT_THAT(
        error_of([&] { (void)read_volume(folder_); }),
        AllOf(HasSubstr("slice gap = 4 mm (1 missing)"), HasSubstr("_97"), HasSubstr("_96"), HasSubstr("even, 2 mm")));
}

TEST_F(Dicom, TwoSlicesAtOnePlaceAreRefused) {
    write_series({0, 2, 2, 4});
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }), HasSubstr("same place"));
}

/// Slices 3 mm apart along z, whose places along y are given.
void write_tilted(const std::filesystem::path& folder, const std::vector<double>& y_mm) {
    DicomBytes dicom;
    for (std::size_t i = 0; i < y_mm.size(); ++i) {
        dicom.position = "0\\" + std::to_string(y_mm[i]) + "\\" + std::to_string(3 * i);
        dicom.instance_uid = "1.2.3.1." + std::to_string(i);
        std::ofstream(folder / std::to_string(i), std::ios::binary)
            << dicom.with(std::vector<std::uint16_t>(6, static_cast<std::uint16_t>(1024 + 100 * i)));
    }
}

TEST_F(Dicom, TiltedGantryIsResampledWithANote) {
    write_tilted(folder_, {0, 0.75, 1.5});  // a row further from slice to slice: voxels move by whole rows
    const VolumeFile file = read_volume(folder_);
    EXPECT_THAT(file.notes, Contains(HasSubstr("14.036 degrees off a right angle")));
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 4, 3));
    EXPECT_LT((file.volume.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 3)).norm(), 1e-9);
    EXPECT_LT((file.volume.grid.origin_mm).norm(), 1e-9);
    for (int z = 0; z < 3; ++z) {
        for (int y = 0; y < 4; ++y) {
            const bool is_inside = y >= z && y < z + 2;
            EXPECT_NEAR(file.volume(1, y, z), is_inside ? 0.0193 * (1 + 0.1 * z) : 0, 1e-6) << y << " " << z;
        }
    }
}

TEST_F(Dicom, SlicesThatAreNoLatticeAreRefused) {
    write_tilted(folder_, {0, 2, 1.5});
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }), HasSubstr("from the line of the others"));
    write_tilted(folder_, {0, 4, 8});
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }), HasSubstr("at most 45 degrees"));
}

TEST_F(Dicom, SlicesOfDifferentSizeAreRefused) {
    write_series({0, 1});
    DicomBytes wide{.position = "10\\20\\2", .columns = 4};
    (void)write("wide", wide.with(std::vector<std::uint16_t>(8, 0)));
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }), AllOf(HasSubstr("4 x 2"), HasSubstr("3 x 2")));
}

TEST_F(Dicom, SliceWithoutPositionIsRefused) {
    write_series({0, 1});
    (void)write("lost", DicomBytes{.position = ""}.with(std::vector<std::uint16_t>(6, 0)));
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }),
                AllOf(HasSubstr("lost"), HasSubstr("ImagePositionPatient")));
}

TEST_F(Dicom, SliceCutOffAnywhereIsRefused) {
    write_series({0, 1});
    const std::string whole = test::content_of(at("1.2.3.1_98"));
    for (std::size_t length = 132; length < whole.size(); ++length) {
        (void)write("1.2.3.1_98", whole.substr(0, length));
        ASSERT_THAT(error_of([&] { (void)read_volume(folder_); }), HasSubstr("1.2.3.1_98")) << length;
    }
}

TEST_F(Dicom, PixelDataShorterThanTheTagsSayIsRefused) {
    write_series({0, 1});
    (void)write("1.2.3.1_98", DicomBytes{.position = "10\\20\\1"}.with({1, 2, 3}));
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }), AllOf(HasSubstr("6 bytes"), HasSubstr("12")));
}

TEST_F(Dicom, SlicesWithoutSeriesUidMakeOneSeries) {
    write_series({0, 1, 2}, {.series_uid = ""});
    EXPECT_EQ(read_volume(folder_).volume.grid.size.z(), 3);
}

TEST_F(Dicom, OneSliceIsNoVolume) {
    write_series({0});
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }), AllOf(HasSubstr("3 x 2 x 1"), HasSubstr("3-D")));
}

}  // namespace
}  // namespace raylign::detail
