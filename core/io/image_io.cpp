#include "core/io/image_io.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/io/raster.h"
#include "core/io/text.h"

namespace raylign {
namespace {

using detail::Raster;

void check_image(const Raster& raster, const std::filesystem::path& path) {
    if (raster.components != 1) {
        throw bad_value("numbers per pixel", std::to_string(raster.components),
                        "1 (grey; colour and transparency are not read)", path.string());
    }
    bool is_plane = raster.size.size() >= 2;
    for (std::size_t axis = 2; axis < raster.size.size(); ++axis) is_plane = is_plane && raster.size[axis] == 1;
    if (!is_plane) throw bad_value("size", detail::size_text(raster.size), "2-D (one image, one frame)", path.string());
}

/// Largest value that the detector could give: of the bits the file says it used, else of the pixel type.
double max_representable(const Raster& raster) {
    if (!detail::is_integer(raster.type)) return 0;
    if (raster.bits_stored > 0) return std::ldexp(1.0, raster.bits_stored) - 1;
    return detail::with_pixels(raster, [](const auto* pixels) {
        return static_cast<double>(std::numeric_limits<std::remove_cvref_t<decltype(*pixels)>>::max());
    });
}

Raster plane_of(int width, int height, int components, detail::PixelType type) {
    Raster raster;
    raster.size = {width, height};
    raster.spacing_mm = {1, 1};
    raster.origin_mm = {0, 0};
    raster.direction = Eigen::MatrixXd::Identity(2, 2);
    raster.components = components;
    raster.type = type;
    return raster;
}

template <typename T>
void set_bytes(Raster& raster, const std::vector<T>& values) {
    raster.bytes.resize(values.size() * sizeof(T));
    std::memcpy(raster.bytes.data(), values.data(), raster.bytes.size());
}

}  // namespace

RawXray read_xray(const std::filesystem::path& path) {
    const Raster raster = detail::read_raster(path, [&](const Raster& header) { check_image(header, path); });
    RawXray xray;
    xray.image = Image(raster.size[0], raster.size[1]);
    detail::with_pixels(raster, [&](const auto* pixels) {
        for (std::size_t i = 0; i < xray.image.pixels.size(); ++i) {
            xray.image.pixels[i] = static_cast<float>(raster.file_value(static_cast<double>(pixels[i])));
        }
    });
    xray.integer_pixels = detail::is_integer(raster.type);
    xray.max_representable = max_representable(raster);
    xray.monochrome1 = raster.white_is_zero;
    return xray;
}

void write_image(const std::filesystem::path& path, const Image& image) {
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension != ".tif" && extension != ".tiff" && extension != ".mha" && extension != ".nrrd") {
        throw bad_value("image format", extension, ".tif, .tiff, .mha or .nrrd", path.string());
    }
    Raster raster = plane_of(image.width, image.height, 1, detail::PixelType::f32);
    raster.format = detail::format_of(path).value();
    set_bytes(raster, image.pixels);
    detail::write_raster(path, raster);
}

void write_png(const std::filesystem::path& path, const RgbImage& image) {
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension != ".png") throw bad_value("image format", extension, ".png", path.string());
    Raster raster = plane_of(image.width, image.height, 3, detail::PixelType::u8);
    raster.format = detail::FileFormat::png;
    set_bytes(raster, image.pixels);
    detail::write_raster(path, raster);
}

}  // namespace raylign
