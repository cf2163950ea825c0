#include "core/io/dicom/secondary_capture.h"

#include "core/io/files/one_eigen.h"

#include <gmock/gmock.h>
#include <itkGDCMImageIO.h>
#include <itkImageFileReader.h>
#include <itkRGBPixel.h>

#include <cmath>
#include <limits>

#include "core/io/dicom/dicom_file.h"
#include "dicom_files.h"
#include "io_files.h"

namespace raylign::detail::test {
namespace {

constexpr std::uint32_t kClass = 0x00080016, kInstance = 0x00080018, kModality = 0x00080060, kDerivation = 0x00082111,
                        kPatient = 0x00100010, kStudy = 0x0020000d, kSeries = 0x0020000e, kComments = 0x00204000;

const CaptureTexts kTexts{
    .series = "series", .derivation = "made so", .comment = "not for diagnosis", .series_seed = "run"};

/// Read by GDCM, which knows nothing of us.
template <typename Pixel>
typename itk::Image<Pixel, 2>::Pointer read_by_gdcm(const std::filesystem::path& path) {
    const auto reader = itk::ImageFileReader<itk::Image<Pixel, 2>>::New();
    reader->SetImageIO(itk::GDCMImageIO::New());
    reader->SetFileName(path.string());
    reader->Update();
    return reader->GetOutput();
}

class SecondaryCapture : public IoTest {
protected:
    std::filesystem::path patient() const {
        DicomBuilder slice = ct_slice(0);
        slice.set(kPatient, "PN", "Doe^Jane").set(kStudy, "UI", "1.2.3.4").set(kInstance, "UI", "1.2.3.4.5");
        return write("ct.dcm", slice.bytes());
    }
};

TEST_F(SecondaryCapture, OfLineIntegralsGivesThemBack) {
    Image image(5, 3);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 0.37F * static_cast<float>(i) - 1;
    image.pixels[7] = std::numeric_limits<float>::quiet_NaN();
    const auto read = read_by_gdcm<float>(write("drr.dcm", secondary_capture(kTexts, image, patient())));
    ASSERT_EQ(read->GetLargestPossibleRegion().GetSize(), (itk::Size<2>{{5, 3}}));
    const double step = 0.37 * 14 / 65535;
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 5; ++x) {
            const double wanted = std::isfinite(image(x, y)) ? image(x, y) : -1;  // what is not finite is the least
            EXPECT_NEAR(read->GetPixel({{x, y}}), wanted, step / 2 + 1e-6) << x << ", " << y;
        }
    }
}

TEST_F(SecondaryCapture, OfAPictureKeepsItsColours) {
    const RgbImage picture{3, 2, {{255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {1, 2, 3}, {200, 100, 50}, {9, 8, 7}}};
    const auto read =
        read_by_gdcm<itk::RGBPixel<std::uint8_t>>(write("overlay.dcm", secondary_capture(kTexts, picture, patient())));
    for (int i = 0; i < 6; ++i) {
        const auto pixel = read->GetPixel({{i % 3, i / 3}});
        for (unsigned c = 0; c < 3; ++c) EXPECT_EQ(pixel[c], picture.pixels[i][c]) << i << ", " << c;
    }
}

TEST_F(SecondaryCapture, IsOfThePatientsStudyAndNamesItsSource) {
    const Image image(2, 2, 1.F);
    const auto tags_of = [&](const CaptureTexts& texts, const std::filesystem::path& source) {
        return open_dicom(write("capture.dcm", secondary_capture(texts, image, source))).tags;
    };
    const DicomTags tags = tags_of(kTexts, patient());
    EXPECT_EQ(tags.text(kClass), "1.2.840.10008.5.1.4.1.1.7");
    EXPECT_EQ(tags.text(kPatient), "Doe^Jane");
    EXPECT_EQ(tags.text(kStudy), "1.2.3.4");
    EXPECT_EQ(tags.text(kModality), "OT");
    EXPECT_EQ(tags.text(kDerivation), "made so");
    EXPECT_EQ(tags.text(kComments), "not for diagnosis");
    const std::string source = bytes_of(std::uint16_t{0x0008}) + bytes_of(std::uint16_t{0x1155}) + "UI" +
                               bytes_of(std::uint16_t{10}) + std::string("1.2.3.4.5\0", 10);  // its instance
    EXPECT_THAT(secondary_capture(kTexts, image, patient()), testing::HasSubstr(source));
    CaptureTexts second = kTexts;
    second.instance = 2;
    const DicomTags other = tags_of(second, patient());
    EXPECT_EQ(tags.text(kSeries), other.text(kSeries));
    EXPECT_NE(tags.text(kInstance), other.text(kInstance));
    second.series_seed = "another run";
    EXPECT_NE(tags.text(kSeries), tags_of(second, patient()).text(kSeries));
    const DicomTags alone = tags_of(kTexts, "");
    EXPECT_TRUE(alone.text(kStudy).starts_with("2.25."));
    EXPECT_EQ(alone.text(kPatient), "");
    EXPECT_THAT(secondary_capture(kTexts, image, ""), testing::Not(testing::HasSubstr("1.2.3.4.5")));
}

TEST_F(SecondaryCapture, FindsTheFirstFileOfAStudy) {
    const auto text = write("views.json", "{}"), dicom = patient();
    EXPECT_EQ(dicom_study_file({"", text, dicom, at("missing")}), dicom);
    EXPECT_EQ(dicom_study_file({text}), "");
}

}  // namespace
}  // namespace raylign::detail::test
