#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io_files.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using test::NiftiBytes;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class NiftiFile : public test::IoTest {
protected:
    [[nodiscard]] VolumeFile read(const NiftiBytes& nifti) const {
        return read_volume(write("ct.nii", nifti.with(bytes_of(test::small_hu()))));
    }
    [[nodiscard]] std::string error(const NiftiBytes& nifti) const {
        return error_of([&] { (void)read(nifti); });
    }
};

void expect_place(const Volume& volume, const Eigen::Vector3d& far_voxel_mm, double tolerance = 1e-4) {
    EXPECT_LT((volume.grid.ct_from_voxel({2, 1, 1}) - far_voxel_mm).norm(), tolerance)
        << volume.grid.ct_from_voxel({2, 1, 1}).transpose();
}
const Eigen::Vector3d kFarVoxel(-11, -20.75, 32);  // of NiftiBytes, in LPS

NiftiBytes scaled_by(float factor, char units) {
    NiftiBytes nifti;
    nifti.units = units;
    for (float& value : nifti.sform) value *= factor;
    for (std::size_t i = 1; i < 4; ++i) nifti.pixdim[i] *= factor;
    return nifti;
}

TEST_F(NiftiFile, MetresAndMicrometresBecomeMillimetres) {
    const VolumeFile metres = read(scaled_by(1e-3F, 1 + 8)), micrometres = read(scaled_by(1e3F, 3));
    expect_place(metres.volume, kFarVoxel);
    expect_place(micrometres.volume, kFarVoxel);
    EXPECT_THAT(metres.notes, Contains(HasSubstr("in metres")));
    EXPECT_THAT(micrometres.notes, Contains(HasSubstr("in micrometres")));
    EXPECT_THAT(read({}).notes, Not(Contains(HasSubstr("metre"))));
}

TEST_F(NiftiFile, UnknownUnitIsTakenAsMillimetresAndNoted) {
    const VolumeFile file = read(scaled_by(1, 0));
    expect_place(file.volume, kFarVoxel);
    EXPECT_THAT(file.notes, Contains(HasSubstr("millimetres assumed")));
    EXPECT_THAT(error(scaled_by(1, 5)), HasSubstr("unit of xyzt_units = 5"));
}

TEST_F(NiftiFile, SformCountsWhereTheQformDisagrees) {
    NiftiBytes nifti;
    nifti.qform_code = 1;
    nifti.sform_code = 2;
    EXPECT_THAT(read(nifti).notes, Not(Contains(HasSubstr("disagree"))));
    nifti.qform = {0, 0, static_cast<float>(std::sin(0.05)), 40, 20, 30};
    const VolumeFile file = read(nifti);
    expect_place(file.volume, kFarVoxel);
    EXPECT_THAT(file.notes, Contains(AllOf(HasSubstr("disagree by up to 30"), HasSubstr("and 5.73 degrees"))));
    nifti.pixdim[0] = -1;
    EXPECT_THAT(read(nifti).notes, Contains(HasSubstr("one of them is mirrored")));
    nifti.qform[0] = kNan;
    EXPECT_THAT(read(nifti).notes, Contains(HasSubstr("the qform is not finite")));
}

TEST_F(NiftiFile, QformAloneIsRead) {
    NiftiBytes nifti;
    nifti.sform_code = 0;
    nifti.sform[0] = kNan;  // does not count
    nifti.qform_code = 1;
    nifti.qform = {0, 0, static_cast<float>(std::sqrt(0.5)), 10, 20, 30};  // x of the file is y of RAS
    expect_place(read(nifti).volume, {-(10 - 0.75), -(20 + 1), 32});
    nifti.pixdim[0] = -1;
    expect_place(read(nifti).volume, {-(10 - 0.75), -(20 + 1), 28});
}

TEST_F(NiftiFile, NeitherFormIsNoted) {
    NiftiBytes nifti;
    nifti.sform_code = 0;
    EXPECT_THAT(read(nifti).notes, Contains(AllOf(HasSubstr("neither sform nor qform"), HasSubstr("mirrored"))));
}

TEST_F(NiftiFile, PixdimThatContradictsTheSformIsNoted) {
    NiftiBytes nifti;
    nifti.pixdim = {1, 1, 1, 1, 1, 1, 1, 1};
    const VolumeFile file = read(nifti);
    expect_place(file.volume, kFarVoxel);
    EXPECT_THAT(file.notes, Contains(AllOf(HasSubstr("1 x 1 x 1 mm"), HasSubstr("0.5 x 0.75 x 2 mm"))));
}

TEST_F(NiftiFile, NumbersThatAreNotFiniteAreNamed) {
    for (const float bad : {kNan, std::numeric_limits<float>::infinity()}) {
        NiftiBytes srow, pixdim, quaternion;
        srow.sform[7] = bad;
        EXPECT_THAT(error(srow), HasSubstr("srow_y[3]"));
        pixdim.pixdim[2] = bad;
        EXPECT_THAT(error(pixdim), HasSubstr("spacing along y"));
        quaternion.sform_code = 0;
        quaternion.qform_code = 1;
        quaternion.qform[1] = bad;
        EXPECT_THAT(error(quaternion), HasSubstr("qform_x"));
    }
}

TEST_F(NiftiFile, OffsetOfTheVoxelsOutOfRangeIsRefused) {
    for (const float bad : {kNan, -1.F, 100.F, 352.5F, 1e30F}) {
        NiftiBytes nifti;
        nifti.offset_slope_intercept[0] = bad;
        EXPECT_THAT(error(nifti), HasSubstr("vox_offset"));
    }
    NiftiBytes beyond, none;
    beyond.offset_slope_intercept[0] = 1e6F;
    EXPECT_THAT(error(beyond), HasSubstr("truncated"));
    none.offset_slope_intercept[0] = 0;
    EXPECT_FLOAT_EQ(read(none).volume(2, 1, 1), static_cast<float>(0.0193 * 4.071));
}

TEST_F(NiftiFile, ScalingIsAppliedAsTheStandardSays) {
    NiftiBytes nifti;
    const float plain = read(nifti).volume(2, 1, 1);
    for (const float none : {0.F, kNan}) {
        nifti.offset_slope_intercept = {352, none, 77};
        EXPECT_EQ(read(nifti).volume(2, 1, 1), plain);
    }
    nifti.offset_slope_intercept = {352, 0.5F, -500};
    const VolumeFile file = read(nifti);
    EXPECT_FLOAT_EQ(file.volume(2, 1, 1), static_cast<float>(0.0193 * (1 + (3071 * 0.5 - 500) / 1000)));
    EXPECT_THAT(file.notes, Contains(HasSubstr("stored * 0.5 + -500")));
    nifti.offset_slope_intercept = {352, 2, kNan};
    EXPECT_THAT(error(nifti), HasSubstr("scl_inter = NaN"));
}

/// The header of NiftiBytes as NIfTI-2.
std::string second_header() {
    const NiftiBytes first;
    std::string header(544, '\0');
    const auto put = [&](std::size_t offset, const auto& value) {
        header.replace(offset, sizeof(value), bytes_of(value));
    };
    put(0, std::int32_t{540});
    header.replace(4, 8, std::string("n+2\0\r\n\032\n", 8));
    put(12, first.datatype);
    put(14, first.bitpix);
    for (std::size_t i = 0; i < 8; ++i) put(16 + 8 * i, static_cast<std::int64_t>(first.dim[i]));
    for (std::size_t i = 0; i < 8; ++i) put(104 + 8 * i, static_cast<double>(first.pixdim[i]));
    put(168, std::int64_t{544});
    put(348, std::int32_t{1});
    for (std::size_t i = 0; i < 12; ++i) put(400 + 8 * i, static_cast<double>(first.sform[i]));
    put(500, std::int32_t{2});
    return header;
}

TEST_F(NiftiFile, SecondVersionIsRead) {
    const VolumeFile file = read_volume(write("ct.nii", second_header() + bytes_of(test::small_hu())));
    expect_place(file.volume, kFarVoxel, 1e-12);
    EXPECT_EQ(file.volume.attenuation_per_mm, read({}).volume.attenuation_per_mm);
    EXPECT_THAT(error_of([&] { (void)read_volume(write("cut.nii", second_header().substr(0, 400))); }),
                HasSubstr("540 bytes"));
}

/// All fields that are read, in the other byte order.
std::string swapped(std::string bytes) {
    const auto swap = [&](std::size_t offset, std::size_t size, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(offset + i * size);
            std::reverse(begin, begin + static_cast<std::ptrdiff_t>(size));
        }
    };
    swap(0, 4, 1), swap(40, 2, 8), swap(70, 2, 2), swap(76, 4, 11), swap(252, 2, 2), swap(256, 4, 18), swap(352, 2, 12);
    return bytes;
}

TEST_F(NiftiFile, OtherByteOrderIsRead) {
    const std::string bytes = NiftiBytes().with(bytes_of(test::small_hu()));
    const VolumeFile file = read_volume(write("big.nii", swapped(bytes)));
    EXPECT_EQ(file.volume.attenuation_per_mm, read({}).volume.attenuation_per_mm);
    expect_place(file.volume, kFarVoxel);
}

TEST_F(NiftiFile, HeaderAndVoxelsInTwoFilesAreReadByEitherName) {
    std::string header = NiftiBytes().with("");
    header.replace(344, 3, "ni1");
    header.replace(108, 4, bytes_of(0.F));
    (void)write("ct.hdr", header);
    (void)write("ct.img", bytes_of(test::small_hu()));
    for (const char* name : {"ct.hdr", "ct.img"}) {
        EXPECT_EQ(read_volume(at(name)).volume.attenuation_per_mm, read({}).volume.attenuation_per_mm);
    }
    std::filesystem::remove(at("ct.img"));
    EXPECT_THAT(error_of([&] { (void)read_volume(at("ct.hdr")); }), HasSubstr("ct.img does not exist"));
}

TEST_F(NiftiFile, GzipInSeveralMembersIsRead) {
    const std::string bytes = NiftiBytes().with(bytes_of(test::small_hu()));
    for (const auto& part : {bytes.substr(0, 360), bytes.substr(360)}) {
        gzFile file = gzopen(at("ct.nii.gz").c_str(), "ab");
        gzwrite(file, part.data(), static_cast<unsigned>(part.size()));
        gzclose(file);
    }
    EXPECT_EQ(read_volume(at("ct.nii.gz")).volume.attenuation_per_mm, read({}).volume.attenuation_per_mm);
}

TEST_F(NiftiFile, ColoursAndComplexNumbersAreRefused) {
    NiftiBytes rgb, complex;
    rgb.datatype = 128;
    EXPECT_THAT(error(rgb), HasSubstr("numbers per voxel = 3"));
    complex.datatype = 32;
    EXPECT_THAT(error(complex), HasSubstr("32 (complex numbers)"));
}

TEST_F(NiftiFile, HeaderThatStatesMoreThanTheFileHoldsIsRefused) {
    for (const std::int16_t n : {std::int16_t{100}, std::int16_t{32767}}) {
        NiftiBytes nifti;
        nifti.dim = {3, n, n, n, 1, 1, 1, 1};
        EXPECT_THAT(error(nifti), HasSubstr("its header states"));
    }
}

}  // namespace
}  // namespace raylign::detail
