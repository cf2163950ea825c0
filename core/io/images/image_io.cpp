#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/error.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/dicom/dicom_xray.h"
#include "core/io/dicom/functional_groups.h"
#include "core/io/dicom/modality.h"
#include "core/io/dicom/pixel_layout.h"
#include "core/io/files/text.h"
#include "core/io/images/counts.h"
#include "core/io/images/png.h"
#include "core/io/images/raster.h"
#include "raylign/io/image.h"

namespace raylign {
using namespace detail;
namespace {

using detail::Raster;

int frames_of(const Raster& raster) {
    double frames = 1;
    for (std::size_t axis = 2; axis < raster.size.size(); ++axis) frames *= raster.size[axis];
    return static_cast<int>(std::min(frames, 1e9));
}

void check_image(const Raster& raster, const std::filesystem::path& path) {
    if (raster.components != 1) {
        throw bad_value("numbers per pixel", std::to_string(raster.components),
                        "1 (grey; colours and transparency are not read)", path.string());
    }
    if (raster.size.size() < 2) throw bad_value("size", detail::size_text(raster.size), "2-D", path.string());
}

void check_frame(const Raster& raster, int frame, const std::filesystem::path& path) {
    const int frames = frames_of(raster);
    if (frame == 0 && frames > 1) {
        throw bad_value("size", detail::size_text(raster.size),
                        "2-D (one image), or \"frame\" in views.json must say which of " + std::to_string(frames) +
                            " frames, from 1",
                        path.string());
    }
    if (frame > frames || frame < 0) {
        throw bad_value("frame", std::to_string(frame), "in [1, " + std::to_string(frames) + "]", path.string());
    }
}

/// Largest value that the detector could give: of the bits the file says it used, else of the pixel type.
double max_representable(const Raster& raster) {
    if (!detail::is_integer(raster.type)) return 0;
    if (raster.largest > 0) return raster.largest;
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

std::optional<detail::DicomTags> tags_of(const Raster& raster, const std::filesystem::path& path) {
    if (raster.format != detail::FileFormat::dicom) return std::nullopt;
    auto tags = detail::read_dicom_tags(path);
    if (tags) detail::check_is_xray(*tags, path.string());
    return tags;
}

void take_padding(const Raster& raster, std::size_t first, RawXray& xray) {
    if (raster.is_padding.empty()) return;
    xray.valid = Image(xray.image.width, xray.image.height, 1);
    std::size_t count = 0;
    for (std::size_t i = 0; i < xray.valid.pixels.size(); ++i) {
        if (!raster.is_padding[first + i]) continue;
        xray.valid.pixels[i] = 0;
        ++count;
    }
    if (count > 0) {
        xray.notes.push_back(std::to_string(count) + " pixels have PixelPaddingValue (0028,0120) and are left out");
    }
}

RawXray frame_of(const Raster& raster, const std::optional<detail::DicomTags>& tags, int frame,
                 const std::filesystem::path& path) {
    RawXray xray;
    xray.image = Image(raster.size[0], raster.size[1]);
    const std::size_t count = xray.image.pixels.size(), first = count * static_cast<std::size_t>(frame);
    detail::with_pixels(raster, [&](const auto* pixels) {
        for (std::size_t i = 0; i < count; ++i) {
            xray.image.pixels[i] = static_cast<float>(static_cast<double>(pixels[first + i]));
        }
    });
    xray.integer_pixels = detail::is_integer(raster.type);
    xray.max_representable = max_representable(raster);
    xray.monochrome1 = raster.white_is_zero;
    xray.shown_dark_by = raster.shown_dark_by;
    xray.notes = raster.notes;
    take_padding(raster, first, xray);
    if (tags) detail::take_dicom_intensity(detail::tags_of_frame(*tags, frame, path.string()), xray);
    return xray;
}

}  // namespace

RawXray read_xray(const std::filesystem::path& path, int frame) {
    const Raster raster = detail::read_raster(path, [&](const Raster& header) {
        check_image(header, path);
        check_frame(header, frame, path);
    });
    return frame_of(raster, tags_of(raster, path), std::max(0, frame - 1), path);
}

struct XrayFile::Contents {
    std::filesystem::path path;
    Raster raster;
    std::optional<detail::DicomTags> tags;
};

XrayFile::XrayFile(const std::filesystem::path& path) {
    Raster raster = detail::read_raster(path, [&](const Raster& header) { check_image(header, path); });
    auto tags = tags_of(raster, path);
    contents_ = std::make_unique<const Contents>(Contents{path, std::move(raster), std::move(tags)});
}

XrayFile::~XrayFile() = default;

int XrayFile::frame_count() const { return frames_of(contents_->raster); }

RawXray XrayFile::frame(int number) const {
    if (number < 1 || number > frame_count()) {
        throw bad_value("frame", std::to_string(number), "in [1, " + std::to_string(frame_count()) + "]",
                        contents_->path.string());
    }
    return frame_of(contents_->raster, contents_->tags, number - 1, contents_->path);
}

Eigen::Vector2i xray_size_px(const std::filesystem::path& path) {
    const Raster header = detail::read_raster_header(path);
    check_image(header, path);
    return {header.size[0], header.size[1]};
}

int xray_frame_count(const std::filesystem::path& path) {
    detail::check_readable_file(path);
    if (detail::format_of(path) == detail::FileFormat::dicom) {
        return detail::pixel_layout(detail::open_dicom(path)).frames;
    }
    return frames_of(detail::read_raster(path, [&](const Raster& header) { check_image(header, path); }));
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

void detail::write_counts(const std::filesystem::path& path, const Image& counts, double largest) {
    for (std::size_t i = 0; i < counts.pixels.size(); ++i) {
        const float value = counts.pixels[i];
        if (value >= 0 && value <= std::min(largest, 65535.0) && value == std::floor(value)) continue;
        throw bad_value("count " + std::to_string(i), std::to_string(value),
                        "a whole number in [0, " + std::to_string(static_cast<int>(largest)) + "]", path.string());
    }
    const bool is_short = largest > 255;
    Raster raster = plane_of(counts.width, counts.height, 1, is_short ? detail::PixelType::u16 : detail::PixelType::u8);
    raster.format = detail::FileFormat::tiff;
    if (is_short) {
        set_bytes(raster, std::vector<std::uint16_t>(counts.pixels.begin(), counts.pixels.end()));
    } else {
        set_bytes(raster, std::vector<std::uint8_t>(counts.pixels.begin(), counts.pixels.end()));
    }
    detail::write_raster(path, raster);
}

void detail::write_png(const std::filesystem::path& path, const RgbImage& image) {
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension != ".png") throw bad_value("image format", extension, ".png", path.string());
    Raster raster = plane_of(image.width, image.height, 3, detail::PixelType::u8);
    raster.format = detail::FileFormat::png;
    set_bytes(raster, image.pixels);
    detail::write_raster(path, raster);
}

}  // namespace raylign
