#include <gmock/gmock.h>

#include <cstdio>
// After <cstdio>: it uses FILE without declaring it.
#include <jpeglib.h>

#include "io_files.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

struct JpegOptions {
    int width = 32, height = 24, samples = 1, quality = 95;
    J_COLOR_SPACE colours = JCS_GRAYSCALE;
    bool progressive = false;
    std::string exif;
};

void write_jpeg(const std::filesystem::path& path, const JpegOptions& options,
                const std::function<int(int, int, int)>& sample) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = static_cast<JDIMENSION>(options.width);
    jpeg.image_height = static_cast<JDIMENSION>(options.height);
    jpeg.input_components = options.samples;
    jpeg.in_color_space = options.colours;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, options.quality, TRUE);
    if (options.progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    if (!options.exif.empty()) {
        jpeg_write_marker(&jpeg, JPEG_APP0 + 1, reinterpret_cast<const JOCTET*>(options.exif.data()),
                          static_cast<unsigned>(options.exif.size()));
    }
    for (int y = 0; y < options.height; ++y) {
        std::vector<JSAMPLE> row;
        for (int x = 0; x < options.width; ++x) {
            for (int s = 0; s < options.samples; ++s) row.push_back(static_cast<JSAMPLE>(sample(x, y, s)));
        }
        JSAMPROW pointer = row.data();
        jpeg_write_scanlines(&jpeg, &pointer, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    std::fclose(file);
}

int slope(int x, int y, int) { return 3 * x + 4 * y; }

class JpegFiles : public test::IoTest {};

TEST_F(JpegFiles, GreyIsReadWithinItsError) {
    for (const bool progressive : {false, true}) {
        write_jpeg(at("a.jpg"), {.progressive = progressive}, slope);
        const RawXray xray = read_xray(at("a.jpg"));
        ASSERT_EQ(xray.image.width, 32);
        ASSERT_EQ(xray.image.height, 24);
        for (int y = 0; y < 24; ++y) {
            for (int x = 0; x < 32; ++x) EXPECT_NEAR(xray.image(x, y), slope(x, y, 0), 3) << x << ", " << y;
        }
        EXPECT_TRUE(xray.integer_pixels);
        EXPECT_EQ(xray.max_representable, 255);
        EXPECT_THAT(xray.notes, Contains(AllOf(HasSubstr("JPEG"), HasSubstr("lossy"))));
    }
}

TEST_F(JpegFiles, ColoursThatAgreeAreGreyAndOthersRefused) {
    write_jpeg(at("grey.jpeg"), {.samples = 3, .colours = JCS_RGB}, slope);
    EXPECT_NEAR(read_xray(at("grey.jpeg")).image(9, 7), slope(9, 7, 0), 4);
    write_jpeg(at("letters.jpg"), {.samples = 3, .colours = JCS_RGB},
               [](int x, int y, int s) { return x > 20 && y > 12 && s == 2 ? 0 : 200; });
    EXPECT_THAT(error_of([&] { (void)read_xray(at("letters.jpg")); }),
                AllOf(HasSubstr("colour of pixel ("), HasSubstr("letters.jpg"), HasSubstr("grey")));
    write_jpeg(at("inks.jpg"), {.samples = 4, .colours = JCS_CMYK}, slope);
    EXPECT_THAT(error_of([&] { (void)read_xray(at("inks.jpg")); }), AllOf(HasSubstr("CMYK"), HasSubstr("inks.jpg")));
}

TEST_F(JpegFiles, CutFilesAndOtherDepthsAreErrors) {
    write_jpeg(at("whole.jpg"), {}, [](int x, int y, int) { return (x * 97 + y * 57) % 256; });
    const std::string whole = test::content_of(at("whole.jpg"));
    for (std::size_t length = 1; length + 2 < whole.size(); length += 7) {
        const auto path = write("cut.jpg", whole.substr(0, length));
        EXPECT_THAT(error_of([&] { (void)read_xray(path); }), HasSubstr("cut.jpg")) << length;
    }
    std::string deep = whole;
    const std::size_t frame = deep.find("\xFF\xC0");
    deep[frame + 4] = 12;
    EXPECT_THAT(error_of([&] { (void)read_xray(write("deep.jpg", deep)); }),
                AllOf(HasSubstr("deep.jpg"), HasSubstr("8 bits")));
    std::string large = whole;
    large.replace(frame + 5, 4, "\xEA\x60\xEA\x60");
    EXPECT_THAT(error_of([&] { (void)read_xray(write("large.jpg", large)); }),
                AllOf(HasSubstr("60000 x 60000"), HasSubstr("the file holds")));
    EXPECT_THAT(error_of([&] { (void)read_xray(write("text.jpg", "hello")); }), HasSubstr("text.jpg"));
}

TEST_F(JpegFiles, OrientationOfExifIsNoted) {
    for (const bool big : {false, true}) {
        const std::string exif =
            big ? std::string("Exif\0\0MM\0\x2A\0\0\0\x8\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0", 32)
                : std::string("Exif\0\0II\x2A\0\x8\0\0\0\1\0\x12\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0", 32);
        write_jpeg(at("a.jpg"), {.exif = exif}, slope);
        EXPECT_THAT(read_xray(at("a.jpg")).notes, Contains(HasSubstr("Orientation 6"))) << big;
        for (std::size_t length = 0; length < exif.size(); ++length) {
            write_jpeg(at("cut.jpg"), {.exif = exif.substr(0, length)}, slope);
            EXPECT_NO_THROW((void)read_xray(at("cut.jpg"))) << length;
        }
    }
}

}  // namespace
}  // namespace raylign::detail
