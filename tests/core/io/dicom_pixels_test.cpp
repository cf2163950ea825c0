#include <gmock/gmock.h>

#include "dicom_files.h"
#include "io_files.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

using test::DicomBuilder;
using test::error_of;
using test::sequence_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kRle = "1.2.840.10008.1.2.5";
constexpr const char* kJpegLossless = "1.2.840.10008.1.2.4.70";
constexpr const char* kJpeg2000 = "1.2.840.10008.1.2.4.90";

/// An X-ray of 3 x 2 pixels, 12 of 16 bits: 0, 1, 2, 3, 4, 4095.
DicomBuilder small_xray() {
    DicomBuilder file;
    file.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.1").set(0x00080060, "CS", "CR");
    file.set(0x00280004, "CS", "MONOCHROME2").us(0x00280002, 1).us(0x00280010, 2).us(0x00280011, 3);
    file.us(0x00280100, 16).us(0x00280101, 12).us(0x00280102, 11).us(0x00280103, 0);
    file.pixels = {0, 1, 2, 3, 4, 4095};
    return file;
}

/// A JPEG that ends where its pixels would begin.
std::string jpeg_header(int rows, int columns, int samples, int precision) {
    std::string bytes = {'\xff', '\xd8', '\xff', '\xc3', 0, 11};
    for (const int value : {precision, rows >> 8, rows & 255, columns >> 8, columns & 255, samples, 1, 0x11, 0}) {
        bytes += static_cast<char>(value);
    }
    return bytes + std::string({'\xff', '\xda', 0, 2});
}

std::string jpeg_2000_header(int columns, int rows, int samples, int precision) {
    std::string bytes = {'\xff', '\x4f', '\xff', '\x51', 0, 41, 0, 0};
    const auto number = [&](int value, int count) {
        for (int i = count - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i));
    };
    for (const int value : {columns, rows, 0, 0, columns, rows, 0, 0}) number(value, 4);
    number(samples, 2);
    for (int i = 0; i < samples; ++i) {
        for (const int value : {precision - 1, 1, 1}) number(value, 1);
    }
    return bytes;
}

/// One RLE frame of these segments.
std::string rle(const std::vector<std::string>& segments) {
    std::vector<std::uint32_t> head(16, 0);
    head[0] = static_cast<std::uint32_t>(segments.size());
    std::string data;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        head[i + 1] = static_cast<std::uint32_t>(64 + data.size());
        data += segments[i];
    }
    return test::bytes_of(head) + data;
}

class DicomPixels : public test::IoTest {
protected:
    [[nodiscard]] RawXray read(const DicomBuilder& file) const { return read_xray(write("x.dcm", file.bytes())); }
    [[nodiscard]] std::string problem_of(const DicomBuilder& file) const {
        return error_of([&] { (void)read(file); });
    }
    [[nodiscard]] std::string problem_of(const std::string& syntax, const std::string& fragment) const {
        DicomBuilder file = small_xray();
        file.syntax = syntax;
        file.fragments = {fragment};
        return problem_of(file);
    }
};

TEST_F(DicomPixels, AllUncompressedSyntaxesGiveTheSame) {
    for (const char* syntax :
         {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.1.99", "1.2.840.10008.1.2.2"}) {
        DicomBuilder file = small_xray();
        file.syntax = syntax;
        EXPECT_EQ(read(file).image.pixels, (std::vector<float>{0, 1, 2, 3, 4, 4095})) << syntax;
        EXPECT_EQ(read(file).max_representable, 4095) << syntax;
        file.us(0x00280100, 8).us(0x00280101, 8).us(0x00280102, 7);
        file.pixels = {0, 1, 2, 3, 4, 255};
        EXPECT_EQ(read(file).image.pixels, (std::vector<float>{0, 1, 2, 3, 4, 255})) << syntax;
    }
}

TEST_F(DicomPixels, AFileThatSaysImplicitAndIsExplicitIsRead) {
    std::string bytes = small_xray().bytes();
    const std::string stated("1.2.840.10008.1.2.1\0", 20), wrong("1.2.840.10008.1.2\0\0\0", 20);
    bytes.replace(bytes.find(stated), stated.size(), wrong);
    EXPECT_EQ(read_xray(write("x.dcm", bytes)).image.pixels[5], 4095);
}

TEST_F(DicomPixels, ADamagedDeflatedFileIsRefused) {
    DicomBuilder file = small_xray();
    file.syntax = "1.2.840.10008.1.2.1.99";
    const std::string whole = file.bytes();
    for (const std::size_t left : {std::size_t{20}, whole.size() / 3}) {
        const auto path = write("x.dcm", whole.substr(0, whole.size() - left));
        EXPECT_THAT(error_of([&] { (void)read_xray(path); }), AllOf(HasSubstr("x.dcm"), HasSubstr("truncated")));
    }
}

TEST_F(DicomPixels, FilesWithoutPreambleAreRead) {
    for (const char* syntax : {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1"}) {
        for (const bool has_meta : {false, true}) {
            DicomBuilder file = small_xray();
            file.syntax = syntax;
            file.has_preamble = false;
            file.has_meta = has_meta;
            EXPECT_EQ(read_xray(write("noext", file.bytes())).image.pixels[5], 4095) << syntax << has_meta;
        }
    }
}

TEST_F(DicomPixels, ElementsThatAnotherProgramDidNotKnowAreRead) {
    DicomBuilder file = small_xray();
    file.set(0x00280010, "UN", test::bytes_of(std::uint16_t{2})).set(0x00281041, "UN", "\xff\xff");
    EXPECT_EQ(read(file).image.height, 2);
    EXPECT_EQ(read(file).relation_sign, -1);
}

TEST_F(DicomPixels, OtherSyntaxesAreNamed) {
    EXPECT_THAT(problem_of("1.2.840.10008.1.2.4.100", "x"),
                AllOf(HasSubstr("TransferSyntaxUID (0002,0010) = 1.2.840.10008.1.2.4.100"), HasSubstr("gdcmconv")));
}

TEST_F(DicomPixels, ValueRepresentationsThatAreNoneAreRefused) {
    DicomBuilder file = small_xray();
    file.set(0x00080070, "UY", "maker");
    EXPECT_THAT(problem_of(file), AllOf(HasSubstr("value representation"), HasSubstr("x.dcm")));
}

TEST_F(DicomPixels, ModalityLutIsAppliedAndNamed) {
    const auto with_lut = [](std::uint16_t first, std::uint16_t bits) {
        DicomBuilder lut, file = small_xray();
        lut.set(0x00283002, "US", test::bytes_of(std::vector<std::uint16_t>{3, first, bits}))
            .set(0x00283004, "LO", "OD");
        lut.set(0x00283006, "OW", test::bytes_of(std::vector<std::uint16_t>{50, 70, 1000}));
        return file.set(0x00283000, "SQ", sequence_of({lut}));
    };
    const RawXray xray = read(with_lut(1, 10));
    EXPECT_EQ(xray.image.pixels, (std::vector<float>{50, 50, 70, 1000, 1000, 1000}));
    EXPECT_EQ(xray.max_representable, 1000);
    EXPECT_THAT(xray.notes, Contains(AllOf(HasSubstr("Modality LUT (0028,3000)"), HasSubstr("type OD"))));
    EXPECT_THAT(problem_of(with_lut(1, 99)), HasSubstr("LUTDescriptor (0028,3002)"));
    DicomBuilder twice = with_lut(1, 10);
    twice.set(0x00281053, "DS", "2").set(0x00281052, "DS", "0");
    EXPECT_THAT(problem_of(twice), HasSubstr("must be one of them"));
    EXPECT_EQ(read(with_lut(1, 10).set(0x00281040, "CS", "LOG").set(0x00080060, "CS", "XA")).relation,
              IntensityRelation::linear);
}

TEST_F(DicomPixels, TagsThatDecideThePolarityAreNamed) {
    const auto with = [](const char* photometric, const char* shape) {
        return small_xray().set(0x00280004, "CS", photometric).set(0x20500020, "CS", shape);
    };
    EXPECT_FALSE(read(with("MONOCHROME2", "IDENTITY")).monochrome1);
    const RawXray both = read(with("MONOCHROME1", "INVERSE"));
    EXPECT_TRUE(both.monochrome1);  // one inversion, not two
    EXPECT_THAT(both.shown_dark_by, AllOf(HasSubstr("MONOCHROME1"), HasSubstr("PresentationLUTShape (2050,0020)")));
    EXPECT_EQ(both.image.pixels[5], 4095);
    EXPECT_THAT(both.notes, Not(Contains(HasSubstr("do not go together"))));
    const RawXray inverse = read(with("MONOCHROME2", "INVERSE"));
    EXPECT_TRUE(inverse.monochrome1);
    EXPECT_THAT(inverse.notes, Contains(HasSubstr("do not go together")));
    EXPECT_THAT(problem_of(with("MONOCHROME1", "UPSIDE")), HasSubstr("PresentationLUTShape (2050,0020) = UPSIDE"));
    DicomBuilder windowed = small_xray();
    windowed.set(0x00281050, "DS", "100").set(0x00281051, "DS", "50");
    EXPECT_THAT(read(windowed).notes, Contains(HasSubstr("for display")));
    EXPECT_EQ(read(windowed).image.pixels[5], 4095);
}

TEST_F(DicomPixels, PaddingOfAnXrayIsLeftOut) {
    DicomBuilder file = small_xray();
    file.us(0x00280120, 4095);
    const RawXray xray = read(file);
    EXPECT_EQ(xray.valid.pixels, (std::vector<float>{1, 1, 1, 1, 1, 0}));
    EXPECT_THAT(xray.notes, Contains(HasSubstr("1 pixels have PixelPaddingValue (0028,0120)")));
    const XrayConversion converted = line_integral_from_xray(xray, {}, {}, "x.dcm");
    EXPECT_EQ(converted.weights.pixels, xray.valid.pixels);
    EXPECT_THAT(converted.decisions, Contains(HasSubstr("PixelPaddingValue")));
}

TEST_F(DicomPixels, RleIsDecodedAndItsSegmentsAreChecked) {
    const std::string high = {'\xfc', 0, 0, '\x0f'};     // five zeros, one 15
    const std::string low = {5, 0, 1, 2, 3, 4, '\xff'};  // six bytes as they are
    DicomBuilder file = small_xray();
    file.syntax = kRle;
    file.fragments = {rle({high, low})};
    EXPECT_EQ(read(file).image.pixels, (std::vector<float>{0, 1, 2, 3, 4, 4095}));
    EXPECT_THAT(problem_of(kRle, rle({high})), HasSubstr("number of RLE segments = 1"));
    EXPECT_THAT(problem_of(kRle, rle(std::vector<std::string>(15, low))), HasSubstr("number of RLE segments = 15"));
    EXPECT_THAT(problem_of(kRle, rle({high, low.substr(0, 4)})), HasSubstr("holds fewer pixels"));
    EXPECT_THAT(problem_of(kRle, "short"), HasSubstr("header of 64 bytes"));
    std::string outside = rle({high, low});
    outside[5] = '\x7f';
    EXPECT_THAT(problem_of(kRle, outside), HasSubstr("offset of RLE segment 1"));
}

TEST_F(DicomPixels, CompressedImagesOfAnotherSizeAreRefused) {
    EXPECT_THAT(problem_of(kJpegLossless, jpeg_header(2, 4, 1, 12)),
                AllOf(HasSubstr("columns of the compressed image = 4"), HasSubstr("Columns (0028,0011) = 3")));
    EXPECT_THAT(problem_of(kJpegLossless, jpeg_header(3, 3, 1, 12)), HasSubstr("rows of the compressed image = 3"));
    EXPECT_THAT(problem_of(kJpegLossless, jpeg_header(2, 3, 3, 8)), HasSubstr("samples per pixel"));
    EXPECT_THAT(problem_of(kJpegLossless, jpeg_header(2, 3, 1, 17)), HasSubstr("bits of the compressed image = 17"));
    EXPECT_THAT(problem_of(kJpegLossless, "no JPEG"), HasSubstr("do not begin as JPEG"));
    EXPECT_THAT(problem_of(kJpegLossless, jpeg_header(2, 3, 1, 12).substr(0, 6)), HasSubstr("end within their header"));
    EXPECT_THAT(problem_of(kJpegLossless, "\xff\xd8\xff\xda"), HasSubstr("no frame header"));
    EXPECT_THAT(problem_of("1.2.840.10008.1.2.4.80", jpeg_header(2, 3, 1, 12)), HasSubstr("another kind of JPEG"));
    EXPECT_THAT(problem_of(kJpeg2000, jpeg_2000_header(64, 64, 1, 12)),
                HasSubstr("columns of the compressed image = 64"));
    EXPECT_THAT(problem_of(kJpeg2000, jpeg_2000_header(3, 2, 2, 12)),
                HasSubstr("samples per pixel of the compressed image = 2"));
    EXPECT_THAT(problem_of(kJpeg2000, "\xff\x4f\xff\x51"), HasSubstr("end within their header"));
    EXPECT_THAT(problem_of(kJpeg2000, jpeg_2000_header(3, 2, 1, 12)), HasSubstr("end mark FF D9"));
}

TEST_F(DicomPixels, MoreFramesThanBytesAreRefusedBeforeAnythingIsAllocated) {
    DicomBuilder file = small_xray();
    file.set(0x00280008, "IS", "50000000");
    EXPECT_THAT(problem_of(file), AllOf(HasSubstr("12 bytes"), HasSubstr("50000000 frames")));
    EXPECT_THAT(error_of([&] { (void)xray_frame_count(at("x.dcm")); }), HasSubstr("50000000 frames"));
    file.syntax = kRle;
    file.fragments = {"x"};
    EXPECT_THAT(problem_of(file), AllOf(HasSubstr("NumberOfFrames (0028,0008) = 50000000"), HasSubstr("at most")));
}

TEST_F(DicomPixels, ColourIsRefused) {
    DicomBuilder file = small_xray();
    file.us(0x00280002, 3).set(0x00280004, "CS", "RGB").us(0x00280100, 8).us(0x00280101, 8).us(0x00280102, 7);
    file.pixels.assign(18, 1);
    EXPECT_THAT(problem_of(file), HasSubstr("numbers per pixel = 3"));
    EXPECT_THAT(problem_of(small_xray().set(0x00280004, "CS", "PALETTE COLOR")), HasSubstr("colour is not read"));
}

TEST_F(DicomPixels, EveryCutIsAnErrorThatNamesTheFile) {
    DicomBuilder file = small_xray();
    DicomBuilder lut;
    lut.set(0x00283002, "US", test::bytes_of(std::vector<std::uint16_t>{1, 0, 16}));
    lut.set(0x00283006, "OW", std::string("\1\0", 2));
    file.set(0x00283000, "SQ", sequence_of({lut}));
    file.syntax = kRle;
    file.fragments = {rle({std::string({'\xfb', 0}), std::string({'\xfb', 1})})};
    const std::string whole = file.bytes();
    ASSERT_EQ(read(file).image.pixels, std::vector<float>(6, 1));
    for (std::size_t length = 132; length < whole.size(); ++length) {
        (void)write("x.dcm", whole.substr(0, length));
        ASSERT_THAT(error_of([&] { (void)read_xray(at("x.dcm")); }), HasSubstr("x.dcm")) << length;
    }
}

}  // namespace
}  // namespace raylign::detail
