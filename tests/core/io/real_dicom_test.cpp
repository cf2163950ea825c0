#include <gmock/gmock.h>

#include <algorithm>

#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/volume.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

using testing::Contains;
using testing::HasSubstr;

TEST(RealDicom, FourTransferSyntaxesGiveOneVolume) {
    const auto folder = test::test_data() / "dicom";
    RAYLIGN_NEED_DATA(folder);
    const VolumeFile first = read_volume(folder / "CT0012.explicit_little_endian.dcm");
    EXPECT_EQ(first.volume.grid.size, Eigen::Vector3i(512, 512, 2));
    EXPECT_LT((first.volume.grid.spacing_mm - Eigen::Vector3d(0.388672, 0.388672, 10)).norm(), 1e-9);
    // Columns run to the patient's right, so the normal points to the feet: the upper frame comes first.
    EXPECT_LT((first.volume.grid.origin_mm - Eigen::Vector3d(99.5, -301.5, -149)).norm(), 1e-9);
    EXPECT_GT(*std::ranges::max_element(first.volume.attenuation_per_mm), 0.01F);
    for (const char* name : {"CT0012.fragmented_no_bot_jpeg_lossless.70.dcm",
                             "CT0012.not_fragmented_bot_jpeg_ls.80.dcm", "CT0012.not_fragmented_bot_rle.dcm"}) {
        const VolumeFile other = read_volume(folder / name);
        EXPECT_TRUE(other.volume.attenuation_per_mm == first.volume.attenuation_per_mm) << name;
        EXPECT_EQ(other.volume.grid.origin_mm, first.volume.grid.origin_mm);
    }
}

TEST(RealDicom, DamagedJpegIsAnErrorAndAdditionsToItAreIgnored) {
    const auto path = test::test_data() / "dicom" / "CT0012.fragmented_no_bot_jpeg_lossless.70.dcm";
    RAYLIGN_NEED_DATA(path);
    const std::string whole = test::content_of(path);
    const std::size_t jpeg = whole.find("\xff\xd8\xff\xe0");
    ASSERT_NE(jpeg, std::string::npos);
    const auto file = std::filesystem::path(testing::TempDir()) / "raylign_damaged_jpeg.dcm";
    const auto with = [&](std::size_t at, char value) {
        std::string bytes = whole;
        bytes[jpeg + at] = value;
        std::ofstream(file, std::ios::binary) << bytes;
    };
    with(11, '\5');  // JFIF's version: GDCM aborts on it
    EXPECT_EQ(read_volume(file).volume.grid.size.z(), 2);
    with(78, '\xfa');  // within the pixels
    EXPECT_THAT(test::error_of([&] { (void)read_volume(file); }), HasSubstr("premature end of data segment"));
    std::filesystem::remove(file);
}

TEST(RealDicom, ComputedRadiographyGoesThroughItsModalityLut) {
    const auto path = test::test_data() / "dicom" / "CR-ModalitySequenceLUT.dcm";
    RAYLIGN_NEED_DATA(path);
    const RawXray xray = read_xray(path);
    EXPECT_EQ(xray.image.width, 1976);
    EXPECT_EQ(xray.max_representable, 1023);
    EXPECT_TRUE(xray.monochrome1);
    EXPECT_THAT(xray.notes, Contains(HasSubstr("Modality LUT (0028,3000) applied: 1024 entries")));
    EXPECT_LE(*std::ranges::max_element(xray.image.pixels), 1023);
}

}  // namespace
}  // namespace raylign::detail
