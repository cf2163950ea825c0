#include <gmock/gmock.h>
#include <zlib.h>

#include <limits>

#include "io_files.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using test::MetaText;
using test::NiftiBytes;
using testing::AllOf;
using testing::HasSubstr;

class BadVolume : public test::IoTest {
protected:
    std::string error_reading(const std::filesystem::path& path, const VolumeReadOptions& options = {}) {
        const std::string message = error_of([&] { (void)read_volume(path, options); });
        EXPECT_THAT(message, HasSubstr(path.string()));  // every message says where
        return message;
    }
    std::filesystem::path write_gz(const std::string& name, const std::string& bytes) {
        gzFile file = gzopen(at(name).c_str(), "wb");
        gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
        gzclose(file);
        return at(name);
    }
};

std::string hu_bytes() { return bytes_of(test::small_hu()); }
std::string floats_with(float value) {
    std::vector<float> voxels(12, 100);
    voxels[7] = value;
    return bytes_of(voxels);
}

TEST_F(BadVolume, MissingFileIsNamed) { EXPECT_THAT(error_reading(at("none.nii")), HasSubstr("does not exist")); }
TEST_F(BadVolume, EmptyFileIsNamed) {
    for (const char* name : {"a.nii", "a.nii.gz", "a.mha", "a.nrrd", "a.tif", "a.dcm"}) {
        EXPECT_THAT(error_reading(write(name, "")), HasSubstr("empty"));
    }
}
TEST_F(BadVolume, TextUnderAVolumeNameIsNotRead) {
    for (const char* name : {"a.nii", "a.nii.gz", "a.mha", "a.MHA", "a.mhd", "a.nrrd", "a.tif", "a.dcm", "a.png"}) {
        EXPECT_NE(error_reading(write(name, std::string(600, 'x'))), "");
    }
}
TEST_F(BadVolume, UnknownExtensionListsTheFormats) {
    EXPECT_THAT(error_reading(write("a.xyz", "hello")), AllOf(HasSubstr("NIfTI"), HasSubstr("NRRD")));
}
TEST_F(BadVolume, FolderWithoutDicomIsNamed) { EXPECT_THAT(error_reading(folder_), HasSubstr("no DICOM image")); }

TEST_F(BadVolume, TruncatedMetaImageIsRefused) {
    EXPECT_THAT(error_reading(write("a.mha", MetaText().with(hu_bytes().substr(0, 20)))), HasSubstr("truncated"));
}
TEST_F(BadVolume, TruncatedNiftiIsRefused) {
    EXPECT_THAT(error_reading(write("a.nii", NiftiBytes().with(hu_bytes().substr(0, 20)))), HasSubstr("truncated"));
    EXPECT_THAT(error_reading(write("b.nii", NiftiBytes().with("").substr(0, 200))), HasSubstr("too short"));
}
TEST_F(BadVolume, TruncatedGzipIsRefused) {
    NiftiBytes nifti;
    nifti.dim = {3, 40, 40, 40, 1, 1, 1, 1};
    std::vector<std::int16_t> noise(64000);
    std::uint32_t state = 1;
    for (std::int16_t& v : noise) v = static_cast<std::int16_t>((state = state * 1664525 + 1013904223) >> 21);
    const std::string whole = test::content_of(write_gz("a.nii.gz", nifti.with(bytes_of(noise))));
    EXPECT_THAT(error_reading(write("b.nii.gz", whole.substr(0, whole.size() / 2))), HasSubstr("truncated"));
}
TEST_F(BadVolume, TruncatedNrrdIsRefused) {
    const std::string header =
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 2\nspacings: 1 1 1\nendian: little\nencoding: raw\n\n";
    EXPECT_THAT(error_reading(write("a.nrrd", header + hu_bytes().substr(0, 20))), HasSubstr("truncated"));
}
TEST_F(BadVolume, HeaderThatAsksForMoreThanTheFileCanHoldIsRefused) {
    for (const char* dims : {"900000 900000 900000", "2000 2000 2000"}) {
        EXPECT_THAT(error_reading(write("a.mha", MetaText{.dims = dims}.with("xx"))), HasSubstr("its header states"));
    }
}

TEST_F(BadVolume, TwoDimensionsAreTooFew) {
    MetaText meta{.dims = "4 3", .spacing = "1 1", .matrix = "1 0 0 1"};
    meta.dimensions = 2;
    EXPECT_THAT(error_reading(write("a.mha", meta.with(hu_bytes()))), AllOf(HasSubstr("4 x 3"), HasSubstr("3-D")));
    NiftiBytes nifti;
    nifti.dim = {2, 4, 3, 1, 1, 1, 1, 1};
    EXPECT_THAT(error_reading(write("a.nii", nifti.with(hu_bytes()))), HasSubstr("3-D"));
}
TEST_F(BadVolume, FourDimensionsAreTooMany) {
    NiftiBytes nifti;
    nifti.dim = {4, 3, 2, 1, 2, 1, 1, 1};
    EXPECT_THAT(error_reading(write("a.nii", nifti.with(hu_bytes()))),
                AllOf(HasSubstr("3 x 2 x 1 x 2"), HasSubstr("3-D")));
}
TEST_F(BadVolume, ColourVoxelsAreRefused) {
    const MetaText meta{.type = "MET_UCHAR", .more = "ElementNumberOfChannels = 3\n"};
    EXPECT_THAT(error_reading(write("a.mha", meta.with(std::string(36, 'c')))), HasSubstr("numbers per voxel = 3"));
}

TEST_F(BadVolume, NanAndInfNameTheVoxel) {
    const MetaText meta{.type = "MET_FLOAT"};
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    EXPECT_THAT(error_reading(write("a.mha", meta.with(floats_with(nan)))), HasSubstr("voxel (1, 0, 1) = NaN"));
    EXPECT_THAT(error_reading(write("b.mha", meta.with(floats_with(inf)))), HasSubstr("voxel (1, 0, 1) = Inf"));
}
TEST_F(BadVolume, VoxelsBeyondAFloatNameTheVoxel) {
    std::vector<double> voxels(12, 100.0);
    voxels[7] = -2.5e112;
    const std::string bytes = MetaText{.type = "MET_DOUBLE"}.with(bytes_of(voxels));
    EXPECT_THAT(error_reading(write("a.mha", bytes)), HasSubstr("voxel (1, 0, 1) = -2.5e+112"));
}
TEST_F(BadVolume, NanInNiftiIsNotMendedSilently) {
    NiftiBytes nifti;
    nifti.datatype = 16;
    nifti.bitpix = 32;
    const std::string bytes = nifti.with(floats_with(std::numeric_limits<float>::quiet_NaN()));
    EXPECT_THAT(error_reading(write("a.nii", bytes)), HasSubstr("NaN"));
    EXPECT_THAT(error_reading(write_gz("a.nii.gz", bytes)), HasSubstr("voxel (1, 0, 1) = NaN"));
}

TEST_F(BadVolume, ZeroSpacingIsRefused) {
    EXPECT_THAT(error_reading(write("a.mha", MetaText{.spacing = "0.5 0 2"}.with(hu_bytes()))),
                AllOf(HasSubstr("spacing along y = 0"), HasSubstr("positive")));
    NiftiBytes nifti;
    nifti.pixdim[2] = 0;
    EXPECT_THAT(error_reading(write("a.nii", nifti.with(hu_bytes()))), HasSubstr("spacing along y = 0"));
}
TEST_F(BadVolume, NegativeSpacingIsRefused) {
    EXPECT_THAT(error_reading(write("a.mha", MetaText{.spacing = "0.5 0.75 -2"}.with(hu_bytes()))),
                HasSubstr("spacing along z = -2"));
    NiftiBytes nifti;
    nifti.pixdim[3] = -2;
    EXPECT_THAT(error_reading(write("a.nii", nifti.with(hu_bytes()))), HasSubstr("spacing along z = -2"));
}
TEST_F(BadVolume, AxesBeyond45DegreesOffRightAnglesAreRefused) {
    EXPECT_THAT(error_reading(write("a.mha", MetaText{.matrix = "1 0 0 0.8 0.6 0 0 0 1"}.with(hu_bytes()))),
                AllOf(HasSubstr("x and y = 53.13 degrees"), HasSubstr("at most 45 degrees")));
    NiftiBytes nifti;
    nifti.sform[1] = 0.8F;
    EXPECT_THAT(error_reading(write("a.nii", nifti.with(hu_bytes()))), HasSubstr("at most 45 degrees"));
}
TEST_F(BadVolume, ScaledDirectionIsRefused) {
    EXPECT_THAT(error_reading(write("a.mha", MetaText{.matrix = "1 0 0 0 2 0 0 0 1"}.with(hu_bytes()))),
                AllOf(HasSubstr("axis y = 2"), HasSubstr("write the scale as spacing")));
}
TEST_F(BadVolume, AttenuationTakenForHuIsRefused) {
    std::vector<float> voxels(12, 0.02F);
    voxels[3] = 0;
    EXPECT_THAT(error_reading(write("a.mha", MetaText{.type = "MET_FLOAT"}.with(bytes_of(voxels)))),
                AllOf(HasSubstr("from 0 to 0.02"), HasSubstr("1/mm need --attenuation")));
}
TEST_F(BadVolume, HuTakenForAttenuationAreRefused) {
    for (const float hu : {-2.0F, 11.0F}) {
        std::vector<float> voxels(12, 0.02F);
        voxels[3] = hu;
        EXPECT_THAT(error_reading(write("a.mha", MetaText{.type = "MET_FLOAT"}.with(bytes_of(voxels))),
                                  {.is_attenuation = true}),
                    HasSubstr("look like HU"));
    }
}
TEST_F(BadVolume, PlainFileNamedGzIsRefused) {
    for (const std::string& bytes : {NiftiBytes().with(hu_bytes()), std::string(600, 'x'), std::string("x")}) {
        EXPECT_THAT(error_reading(write("a.nii.gz", bytes)), HasSubstr("is not a gzip file"));
    }
}
TEST_F(BadVolume, UnknownPresetListsThePresets) {
    EXPECT_THAT(
        error_of([&] { (void)read_volume(write("a.mha", MetaText().with(hu_bytes())), {.hu_preset = "bone"}); }),
        AllOf(HasSubstr("bone"), HasSubstr("water-60kev"), HasSubstr("plastimatch")));
}
TEST_F(BadVolume, SeriesForAFileIsRefused) {
    EXPECT_THAT(error_reading(write("a.mha", MetaText().with(hu_bytes())), {.series = "1"}), HasSubstr("--series"));
}

}  // namespace
}  // namespace raylign::detail
