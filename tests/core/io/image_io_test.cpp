#include <gmock/gmock.h>
#include <tiffio.h>

#include <limits>

#include "core/io/images/png.h"
#include "core/io/images/raster.h"
#include "io_files.h"
#include "raylign/io/image.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using testing::AllOf;
using testing::HasSubstr;

class ImageIo : public test::IoTest {};

Image ramp() {
    Image image(5, 3);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = 0.1F * static_cast<float>(i) - 0.3F;
    return image;
}

TEST_F(ImageIo, FloatImagesRoundTrip) {
    for (const char* name : {"a.tif", "a.tiff", "a.mha", "a.nrrd"}) {
        write_image(at(name), ramp());
        const RawXray xray = read_xray(at(name));
        EXPECT_EQ(xray.image.pixels, ramp().pixels) << name;
        EXPECT_EQ(xray.image.width, 5);
        EXPECT_FALSE(xray.integer_pixels);
        EXPECT_EQ(xray.max_representable, 0);
    }
}

TEST_F(ImageIo, NonFinitePixelsArePassedOn) {
    Image image = ramp();
    image(1, 1) = std::numeric_limits<float>::quiet_NaN();
    write_image(at("a.tif"), image);
    EXPECT_TRUE(std::isnan(read_xray(at("a.tif")).image(1, 1)));
}

detail::Raster grey_raster(detail::FileFormat format, detail::PixelType type, const std::string& bytes) {
    detail::Raster raster{.format = format, .size = {3, 2}, .spacing_mm = {1, 1}, .origin_mm = {0, 0}, .type = type};
    raster.direction = Eigen::MatrixXd::Identity(2, 2);
    raster.bytes.resize(bytes.size());
    std::memcpy(raster.bytes.data(), bytes.data(), bytes.size());
    return raster;
}

TEST_F(ImageIo, IntegerImagesKeepTheirNumbersAndRange) {
    const std::vector<std::uint16_t> pixels = {0, 1, 4095, 256, 65535, 7};
    const std::vector<std::uint8_t> small = {0, 1, 255, 128, 64, 7};
    for (const auto& [name, format] : {std::pair{"a.png", detail::FileFormat::png},
                                       {"a.tif", detail::FileFormat::tiff},
                                       {"a.mha", detail::FileFormat::meta},
                                       {"a.nrrd", detail::FileFormat::nrrd}}) {
        detail::write_raster(at(name), grey_raster(format, detail::PixelType::u16, bytes_of(pixels)));
        const RawXray xray = read_xray(at(name));
        EXPECT_EQ(xray.image.pixels, std::vector<float>(pixels.begin(), pixels.end())) << name;
        EXPECT_TRUE(xray.integer_pixels);
        EXPECT_EQ(xray.max_representable, 65535);
        detail::write_raster(at(name), grey_raster(format, detail::PixelType::u8, bytes_of(small)));
        EXPECT_EQ(read_xray(at(name)).image.pixels, std::vector<float>(small.begin(), small.end())) << name;
        EXPECT_EQ(read_xray(at(name)).max_representable, 255);
    }
}

TEST_F(ImageIo, OneSliceOfAVolumeFileIsAnImage) {
    const test::MetaText meta{.dims = "3 2 1"};
    EXPECT_EQ(read_xray(write("a.mha", meta.with(bytes_of(std::vector<std::int16_t>{1, 2, 3, 4, 5, 6})))).image(2, 1),
              6);
}

TEST_F(ImageIo, VolumeIsNoImage) {
    EXPECT_THAT(error_of([&] { (void)read_xray(write("a.mha", test::MetaText().with(bytes_of(test::small_hu())))); }),
                AllOf(HasSubstr("3 x 2 x 2"), HasSubstr("2-D")));
}

TEST_F(ImageIo, ColourPngRoundTripsButIsNoXray) {
    RgbImage image{2, 1, {{255, 0, 1}, {7, 8, 9}}};
    write_png(at("a.png"), image);
    const detail::Raster raster = detail::read_raster(at("a.png"));
    EXPECT_EQ(raster.components, 3);
    EXPECT_EQ(static_cast<int>(raster.bytes[3]), 7);
    EXPECT_THAT(error_of([&] { (void)read_xray(at("a.png")); }),
                AllOf(HasSubstr("a.png"), HasSubstr("3"), HasSubstr("grey")));
}

TEST_F(ImageIo, ColourPngOfGreysIsWrittenAsItIs) {
    const RgbImage image{2, 1, {{5, 5, 5}, {7, 7, 7}}};
    write_png(at("a.png"), image);
    EXPECT_EQ(read_xray(at("a.png")).image.pixels, (std::vector<float>{5, 7}));
}

TEST_F(ImageIo, WhiteIsZeroTiffIsMonochrome1) {
    TIFF* file = TIFFOpen(at("a.tif").c_str(), "w");
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, 2);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, 1);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISWHITE);
    std::vector<std::uint8_t> row = {3, 250};
    TIFFWriteScanline(file, row.data(), 0, 0);
    TIFFClose(file);
    const RawXray xray = read_xray(at("a.tif"));
    EXPECT_TRUE(xray.monochrome1);
    EXPECT_EQ(xray.image.pixels, (std::vector<float>{3, 250}));
}

TEST_F(ImageIo, TiledTiffIsRead) {
    TIFF* file = TIFFOpen(at("a.tif").c_str(), "w");
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, 20);
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, 18);
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(file, TIFFTAG_TILEWIDTH, 16);
    TIFFSetField(file, TIFFTAG_TILELENGTH, 16);
    for (std::uint32_t ty = 0; ty < 32; ty += 16) {
        for (std::uint32_t tx = 0; tx < 32; tx += 16) {
            std::vector<std::uint8_t> tile;
            for (std::uint32_t y = ty; y < ty + 16; ++y) {
                for (std::uint32_t x = tx; x < tx + 16; ++x)
                    tile.push_back(static_cast<std::uint8_t>(x + 10 * (y % 20)));
            }
            TIFFWriteTile(file, tile.data(), tx, ty, 0, 0);
        }
    }
    TIFFClose(file);
    const Image image = read_xray(at("a.tif")).image;
    EXPECT_EQ(image(19, 17), 19 + 170);
    EXPECT_EQ(image(0, 0), 0);
}

TEST_F(ImageIo, TruncatedImagesAreRefused) {
    Image noise(64, 64);
    std::uint32_t state = 7;
    for (float& value : noise.pixels) value = static_cast<float>(state = state * 1664525 + 1013904223);
    RgbImage colours{64, 64, std::vector<std::array<std::uint8_t, 3>>(64 * 64)};
    for (auto& pixel : colours.pixels)
        pixel[0] = static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24);
    write_png(at("whole.png"), colours);
    for (const char* name : {"whole.tif", "whole.mha", "whole.nrrd"}) write_image(at(name), noise);
    for (const std::string extension : {".tif", ".mha", ".nrrd", ".png"}) {
        const std::string whole = test::content_of(at("whole" + extension));
        const auto path = write("half" + extension, whole.substr(0, whole.size() / 2));
        const std::string message = error_of([&] { (void)detail::read_raster(path); });
        EXPECT_THAT(message, HasSubstr(path.string()));
    }
}

TEST_F(ImageIo, UnknownExtensionIsRefusedOnWriting) {
    EXPECT_THAT(error_of([&] { write_image(at("a.jpg"), ramp()); }), AllOf(HasSubstr(".jpg"), HasSubstr(".tif")));
    EXPECT_THAT(error_of([&] { write_png(at("a.jpg"), {1, 1, {{0, 0, 0}}}); }), HasSubstr(".png"));
}

TEST_F(ImageIo, MissingFolderIsNamedOnWriting) {
    EXPECT_THAT(error_of([&] { write_image(at("none") / "a.tif", ramp()); }), HasSubstr("there is no folder"));
}

}  // namespace
}  // namespace raylign::detail
