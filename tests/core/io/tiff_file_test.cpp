#include <gmock/gmock.h>
#include <tiffio.h>

#include "io_files.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using Values = std::vector<float>;

/// A directory entry: tag, type (3 = short, 4 = long), count, value.
struct Entry {
    std::uint16_t tag, type;
    std::uint32_t count, value;
};

/// A little-endian TIFF whose pixels stand behind the 8 bytes of its head; a directory per page.
std::string tiff_bytes(const std::string& pixels, const std::vector<std::vector<Entry>>& pages, bool is_loop = false) {
    std::string file =
        "II" + bytes_of(std::uint16_t{42}) + bytes_of(static_cast<std::uint32_t>(8 + pixels.size())) + pixels;
    for (std::size_t i = 0; i < pages.size(); ++i) {
        std::string directory = bytes_of(static_cast<std::uint16_t>(pages[i].size()));
        for (const Entry& e : pages[i]) {
            directory += bytes_of(e.tag) + bytes_of(e.type) + bytes_of(e.count) + bytes_of(e.value);
        }
        const bool is_last = i + 1 == pages.size();
        const std::size_t next = is_last ? (is_loop ? 8 + pixels.size() : 0) : file.size() + directory.size() + 4;
        file += directory + bytes_of(static_cast<std::uint32_t>(next));
    }
    return file;
}

std::vector<Entry> grey_page(std::uint32_t width, std::uint32_t height, std::uint32_t bits, std::uint32_t bytes,
                             std::uint32_t compression = COMPRESSION_NONE) {
    return {{TIFFTAG_IMAGEWIDTH, 4, 1, width},     {TIFFTAG_IMAGELENGTH, 4, 1, height},
            {TIFFTAG_BITSPERSAMPLE, 3, 1, bits},   {TIFFTAG_COMPRESSION, 3, 1, compression},
            {TIFFTAG_PHOTOMETRIC, 3, 1, 1},        {TIFFTAG_STRIPOFFSETS, 4, 1, 8},
            {TIFFTAG_SAMPLESPERPIXEL, 3, 1, 1},    {TIFFTAG_ROWSPERSTRIP, 4, 1, height},
            {TIFFTAG_STRIPBYTECOUNTS, 4, 1, bytes}};
}

std::vector<Entry> with(std::vector<Entry> page, const Entry& entry) {
    std::erase_if(page, [&](const Entry& e) { return e.tag == entry.tag; });
    page.push_back(entry);
    std::ranges::sort(page, {}, &Entry::tag);
    return page;
}

class TiffFiles : public test::IoTest {
protected:
    [[nodiscard]] std::string message(const std::string& bytes) const {
        return error_of([&] { (void)read_xray(write("a.tif", bytes)); });
    }
};

TEST_F(TiffFiles, HeadersThatAskForMoreThanTheFileHoldsAreRefused) {
    const std::string data(28, '\1');
    const auto refused = AllOf(HasSubstr("a.tif"), HasSubstr("states"), HasSubstr("and the file holds 28 bytes"));
    EXPECT_THAT(message(tiff_bytes(data, {grey_page(65536, 65536, 16, 28, COMPRESSION_ADOBE_DEFLATE)})), refused);
    EXPECT_THAT(message(tiff_bytes(data, {grey_page(60000, 1, 8, 28)})), HasSubstr("a.tif, page 1 is truncated"));
    std::vector<Entry> tiled = {{TIFFTAG_IMAGEWIDTH, 4, 1, 32},   {TIFFTAG_IMAGELENGTH, 4, 1, 32},
                                {TIFFTAG_BITSPERSAMPLE, 3, 1, 8}, {TIFFTAG_COMPRESSION, 3, 1, 8},
                                {TIFFTAG_PHOTOMETRIC, 3, 1, 1},   {TIFFTAG_SAMPLESPERPIXEL, 3, 1, 1},
                                {TIFFTAG_TILEWIDTH, 4, 1, 65536}, {TIFFTAG_TILELENGTH, 4, 1, 65536},
                                {TIFFTAG_TILEOFFSETS, 4, 1, 8},   {TIFFTAG_TILEBYTECOUNTS, 4, 1, 28}};
    EXPECT_THAT(message(tiff_bytes(data, {tiled})), refused);
    const std::vector<std::vector<Entry>> sixteen(16, grey_page(1U << 30, 1U << 30, 8, 28, 8));
    EXPECT_THAT(message(tiff_bytes(data, sixteen)), AllOf(HasSubstr("a.tif"), HasSubstr("in [1, 65536]")));
}

TEST_F(TiffFiles, PagesThatShareTheirPixelsCannotAskForMoreThanTheFileHolds) {
    const std::vector<std::vector<Entry>> pages(200, grey_page(100, 100, 8, 10000));
    EXPECT_THAT(message(tiff_bytes(std::string(10000, '\1'), pages)), HasSubstr("up to here the pages state"));
}

TEST_F(TiffFiles, DirectoriesInALoopAndCutFilesAreErrors) {
    const std::string whole = tiff_bytes(std::string(12, '\7'), {grey_page(4, 3, 8, 12), grey_page(4, 3, 8, 12)});
    EXPECT_EQ(read_xray(write("whole.tif", whole), 2).image(3, 2), 7);
    EXPECT_THAT(message(tiff_bytes(std::string(12, '\7'), {grey_page(4, 3, 8, 12)}, true)), HasSubstr("a.tif"));
    constexpr std::size_t kNextPage = 4;  // its last bytes say that there is none
    for (std::size_t length = 1; length < whole.size() - kNextPage; ++length) {
        const auto path = write("cut.tif", whole.substr(0, length));
        EXPECT_THAT(error_of([&] { (void)read_xray(path, 2); }), HasSubstr("cut.tif")) << length;
    }
}

TEST_F(TiffFiles, LibtiffsOwnReasonIsTold) {
    EXPECT_THAT(message("hello, this is no TIFF"),
                AllOf(HasSubstr("a.tif"), HasSubstr("(libtiff: "), HasSubstr("magic")));
    const std::string rubbish = tiff_bytes(std::string(12, '\7'), {grey_page(4, 3, 8, 12, COMPRESSION_ADOBE_DEFLATE)});
    EXPECT_THAT(message(rubbish), AllOf(HasSubstr("page 1"), HasSubstr("(libtiff: ")));
}

TEST_F(TiffFiles, PackedBitsAreUnpacked) {
    const auto pixels = [&](const std::string& data, std::uint32_t width, std::uint32_t height, std::uint32_t bits) {
        const auto page = grey_page(width, height, bits, static_cast<std::uint32_t>(data.size()));
        return read_xray(write("p.tif", tiff_bytes(data, {page})));
    };
    EXPECT_EQ(pixels({"\xA0\x40", 2}, 3, 2, 1).image.pixels, (Values{1, 0, 1, 0, 1, 0}));
    EXPECT_EQ(pixels({"\x1F\x20", 2}, 3, 1, 4).image.pixels, (Values{1, 15, 2}));
    const RawXray twelve = pixels({"\x12\x3A\xBC\xFF\xF0\x01", 6}, 2, 2, 12);
    EXPECT_EQ(twelve.image.pixels, (Values{0x123, 0xABC, 0xFFF, 0x001}));
    EXPECT_EQ(twelve.max_representable, 4095);
    EXPECT_EQ(pixels({"\xFF\xC0\x00\x10", 4}, 3, 1, 10).image.pixels, (Values{1023, 0, 4}));
    EXPECT_THAT(message(tiff_bytes("1234567", {grey_page(2, 1, 24, 6)})), HasSubstr("24 bits"));
}

TEST_F(TiffFiles, OrientationIsNotedAndNotApplied) {
    const auto page = with(grey_page(2, 2, 8, 4), {TIFFTAG_ORIENTATION, 3, 1, 4});
    const RawXray xray = read_xray(write("o.tif", tiff_bytes("\1\2\3\4", {page})));
    EXPECT_EQ(xray.image.pixels, (Values{1, 2, 3, 4}));
    EXPECT_THAT(xray.notes, Contains(AllOf(HasSubstr("Orientation 4"), HasSubstr("\"flip\": \"rows\""))));
    const auto upright = with(grey_page(2, 2, 8, 4), {TIFFTAG_ORIENTATION, 3, 1, 1});
    EXPECT_THAT(read_xray(write("u.tif", tiff_bytes("\1\2\3\4", {upright}))).notes, IsEmpty());
}

TEST_F(TiffFiles, SamplesThatAgreeAreGreyAndOtherColoursRefused) {
    const auto rgb = [&](const std::string& data) {
        auto page =
            with(with(grey_page(2, 1, 8, 6), {TIFFTAG_SAMPLESPERPIXEL, 3, 1, 3}), {TIFFTAG_PHOTOMETRIC, 3, 1, 2});
        // Three shorts do not fit an entry: they stand behind the pixels.
        page = with(page, {TIFFTAG_BITSPERSAMPLE, 3, 3, 14});
        return tiff_bytes(data + bytes_of(std::vector<std::uint16_t>{8, 8, 8}), {page});
    };
    const RawXray grey = read_xray(write("g.tif", rgb("\7\7\7\x9\x9\x9")));
    EXPECT_EQ(grey.image.pixels, (Values{7, 9}));
    EXPECT_THAT(grey.notes, Contains(HasSubstr("taken as grey")));
    EXPECT_THAT(message(rgb("\7\7\7\x9\x9\x8")), HasSubstr("colours and transparency are not read"));
    for (const auto& [photometric, word] :
         {std::pair<std::uint32_t, const char*>{5, "CMYK"}, {8, "interpretation 8"}}) {
        const auto page = with(grey_page(2, 2, 8, 4), {TIFFTAG_PHOTOMETRIC, 3, 1, photometric});
        EXPECT_THAT(message(tiff_bytes("\1\2\3\4", {page})), AllOf(HasSubstr("TIFF colours"), HasSubstr(word)));
    }
}

TEST_F(TiffFiles, BigTiffIsRead) {
    TIFF* file = TIFFOpen(at("b.tif").c_str(), "w8");
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, 2);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(file, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    std::vector<std::uint16_t> row = {300, 65535};
    TIFFWriteScanline(file, row.data(), 0, 0);
    TIFFClose(file);
    EXPECT_EQ(read_xray(at("b.tif")).image.pixels, (Values{300, 65535}));
}

}  // namespace
}  // namespace raylign::detail
