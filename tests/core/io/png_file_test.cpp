#include <gmock/gmock.h>
#include <png.h>

#include <cstdio>

#include "core/io/images/raster.h"
#include "io_files.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

struct PngOptions {
    int width = 4, height = 3, depth = 8, colour_type = PNG_COLOR_TYPE_GRAY, interlace = PNG_INTERLACE_NONE;
    std::vector<png_color> palette;
    int significant_bits = 0;
    double gamma = 0;
    int transparent_grey = -1;
};

/// Writes rows of bytes as PNG stores them.
void write_png_rows(const std::filesystem::path& path, const PngOptions& options, std::vector<std::string> rows) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, file);
    png_set_IHDR(png, info, static_cast<png_uint_32>(options.width), static_cast<png_uint_32>(options.height),
                 options.depth, options.colour_type, options.interlace, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    if (!options.palette.empty()) {
        png_set_PLTE(png, info, options.palette.data(), static_cast<int>(options.palette.size()));
    }
    if (options.significant_bits > 0) {
        const auto bits = static_cast<png_byte>(options.significant_bits);
        const png_color_8 significant = {bits, bits, bits, bits, bits};
        png_set_sBIT(png, info, &significant);
    }
    if (options.gamma > 0) png_set_gAMA(png, info, options.gamma);
    if (options.transparent_grey >= 0) {
        png_color_16 colour{};
        colour.gray = static_cast<png_uint_16>(options.transparent_grey);
        png_set_tRNS(png, info, nullptr, 0, &colour);
    }
    png_write_info(png, info);
    std::vector<png_bytep> pointers;
    for (std::string& row : rows) pointers.push_back(reinterpret_cast<png_bytep>(row.data()));
    png_write_image(png, pointers.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    std::fclose(file);
}

class PngFiles : public test::IoTest {
protected:
    [[nodiscard]] RawXray written(const PngOptions& options, const std::vector<std::string>& rows) const {
        write_png_rows(at("a.png"), options, rows);
        return read_xray(at("a.png"));
    }
};

using Values = std::vector<float>;

TEST_F(PngFiles, BytesAndWordsKeepTheirValues) {
    const RawXray bytes = written({.width = 3, .height = 2}, {{"\0\1\2", 3}, "\xFE\xFF\x80"});
    EXPECT_EQ(bytes.image.pixels, (Values{0, 1, 2, 254, 255, 128}));
    EXPECT_EQ(bytes.max_representable, 255);
    EXPECT_THAT(bytes.notes, IsEmpty());
    const RawXray words = written({.width = 2, .height = 1, .depth = 16}, {{"\x12\x34\xFF\xFE", 4}});
    EXPECT_EQ(words.image.pixels, (Values{0x1234, 0xFFFE}));
    EXPECT_EQ(words.max_representable, 65535);
}

TEST_F(PngFiles, FewerBitsAreSpreadOverEight) {
    EXPECT_EQ(written({.width = 4, .height = 1, .depth = 1}, {"\x50"}).image.pixels, (Values{0, 255, 0, 255}));
    EXPECT_EQ(written({.width = 4, .height = 1, .depth = 2}, {"\x1B"}).image.pixels, (Values{0, 85, 170, 255}));
    EXPECT_EQ(written({.width = 2, .height = 1, .depth = 4}, {"\x0F"}).image.pixels, (Values{0, 255}));
}

TEST_F(PngFiles, InterlacedFilesAreReadAsTheOthers) {
    std::vector<std::string> rows;
    Values expected;
    for (int y = 0; y < 13; ++y) {
        std::string row;
        for (int x = 0; x < 17; ++x) row += static_cast<char>(x * 11 + y);
        for (const char c : row) expected.push_back(static_cast<float>(static_cast<unsigned char>(c)));
        rows.push_back(row);
    }
    EXPECT_EQ(written({.width = 17, .height = 13, .interlace = PNG_INTERLACE_ADAM7}, rows).image.pixels, expected);
}

TEST_F(PngFiles, ColoursThatAgreeAreGrey) {
    for (const auto& [type, row] : {std::pair{PNG_COLOR_TYPE_RGB, std::string("\7\7\7\x9\x9\x9", 6)},
                                    {PNG_COLOR_TYPE_RGBA, std::string("\7\7\7\xFF\x9\x9\x9\xFF", 8)},
                                    {PNG_COLOR_TYPE_GRAY_ALPHA, std::string("\7\xFF\x9\xFF", 4)}}) {
        const RawXray xray = written({.width = 2, .height = 1, .colour_type = type}, {row});
        EXPECT_EQ(xray.image.pixels, (Values{7, 9})) << type;
        EXPECT_THAT(xray.notes, Contains(HasSubstr("taken as grey"))) << type;
    }
    const std::vector<png_color> greys = {{10, 10, 10}, {200, 200, 200}};
    EXPECT_EQ(written({.width = 2, .height = 1, .colour_type = PNG_COLOR_TYPE_PALETTE, .palette = greys}, {{"\1\0", 2}})
                  .image.pixels,
              (Values{200, 10}));
    const std::string words("\x12\x34\x12\x34\x12\x34", 6);
    EXPECT_EQ(written({.width = 1, .height = 1, .depth = 16, .colour_type = PNG_COLOR_TYPE_RGB}, {words}).image(0, 0),
              0x1234);
}

TEST_F(PngFiles, RealColoursAndTransparencyAreRefused) {
    const auto message = [&](const PngOptions& options, const std::string& row) {
        return error_of([&] { (void)written(options, {row}); });
    };
    const auto refused = AllOf(HasSubstr("a.png"), HasSubstr("grey; colours and transparency are not read"));
    EXPECT_THAT(message({.width = 2, .height = 1, .colour_type = PNG_COLOR_TYPE_RGB}, "\7\7\7\x9\x9\x8"), refused);
    EXPECT_THAT(message({.width = 1, .height = 1, .colour_type = PNG_COLOR_TYPE_GRAY_ALPHA}, "\7\xFE"), refused);
    EXPECT_THAT(message({.width = 1, .height = 1, .colour_type = PNG_COLOR_TYPE_RGBA}, "\7\7\7\1"), refused);
    EXPECT_THAT(message({.width = 1, .height = 1, .transparent_grey = 7}, "\7"), refused);
    EXPECT_THAT(message({.width = 1, .height = 1, .colour_type = PNG_COLOR_TYPE_PALETTE, .palette = {{1, 2, 3}}},
                        std::string(1, '\0')),
                refused);
}

TEST_F(PngFiles, SignificantBitsAndGammaAreNoted) {
    const RawXray xray =
        written({.width = 1, .height = 1, .depth = 16, .significant_bits = 12, .gamma = 0.45455}, {{"\x0F\xFF", 2}});
    EXPECT_EQ(xray.image(0, 0), 0x0FFF);
    EXPECT_THAT(xray.notes, Contains(AllOf(HasSubstr("12 of its 16 bits"), HasSubstr("as stored"))));
    EXPECT_THAT(xray.notes, Contains(AllOf(HasSubstr("gamma of 0.4545"), HasSubstr("not applied"))));
    EXPECT_THAT(written({.width = 1, .height = 1, .gamma = 1}, {"\7"}).notes, IsEmpty());
}

TEST_F(PngFiles, EveryCutAndEveryDamagedByteIsAnErrorOrHarmless) {
    std::vector<std::string> rows;
    for (int y = 0; y < 8; ++y) rows.push_back(std::string(8, static_cast<char>(37 * y)));
    write_png_rows(at("whole.png"), {.width = 8, .height = 8}, rows);
    const std::string whole = test::content_of(at("whole.png"));
    for (std::size_t length = 1; length < whole.size(); ++length) {
        const auto path = write("cut.png", whole.substr(0, length));
        EXPECT_THAT(error_of([&] { (void)read_xray(path); }), HasSubstr("cut.png")) << length;
    }
    for (std::size_t at_byte = 0; at_byte < whole.size(); ++at_byte) {
        std::string damaged = whole;
        damaged[at_byte] = static_cast<char>(damaged[at_byte] ^ 0x20);
        const auto path = write("damaged.png", damaged);
        try {
            EXPECT_EQ(read_xray(path).image.pixels, read_xray(at("whole.png")).image.pixels) << at_byte;
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("damaged.png"));
        }
    }
}

TEST_F(PngFiles, AHeaderThatAsksForMoreThanTheFileHoldsIsRefused) {
    write_png_rows(at("a.png"), {.width = 60000, .height = 1}, {std::string(60000, '\0')});
    std::string bytes = test::content_of(at("a.png"));
    // Height 60000 with the checksum of that header.
    bytes.replace(20, 4, std::string("\0\0\xEA\x60", 4));
    std::uint32_t sum = 0xFFFFFFFF;
    for (std::size_t i = 12; i < 29; ++i) {
        sum ^= static_cast<unsigned char>(bytes[i]);
        for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ ((sum & 1) != 0 ? 0xEDB88320U : 0U);
    }
    sum = ~sum;
    for (std::size_t i = 0; i < 4; ++i) bytes[29 + i] = static_cast<char>(sum >> (24 - 8 * i));
    EXPECT_THAT(error_of([&] { (void)read_xray(write("b.png", bytes)); }),
                AllOf(HasSubstr("60000 x 60000"), HasSubstr("the file holds")));
}

}  // namespace
}  // namespace raylign::detail
