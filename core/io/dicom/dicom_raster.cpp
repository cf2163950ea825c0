#include "core/io/dicom/dicom_raster.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/error.h"
#include "core/io/dicom/frame_decoder.h"
#include "core/io/dicom/functional_groups.h"
#include "core/io/dicom/pixel_values.h"
#include "core/io/dicom/tag_numbers.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// What all frames share, and what each one's values stand for.
struct DicomImage {
    DicomFile file;
    PixelLayout layout;
    std::vector<PixelValues> values;  ///< one per frame, or one for all
    std::optional<PaddingRange> padding;

    [[nodiscard]] const PixelValues& of(int frame) const {
        return values.size() == 1 ? values.front() : values[static_cast<std::size_t>(frame)];
    }
};

DicomImage open_image(const std::filesystem::path& path) {
    if (!looks_like_dicom(path)) {
        throw Error(path.string() +
                    " is no DICOM file: it has neither the mark \"DICM\" at byte 128 nor begins with an element");
    }
    DicomImage image;
    image.file = open_dicom(path);
    image.layout = pixel_layout(image.file);
    const DicomTags& tags = image.file.tags;
    const int different = has_functional_groups(tags) ? image.layout.frames : 1;
    for (int frame = 0; frame < different; ++frame) {
        image.values.push_back(pixel_values(tags_of_frame(tags, frame, image.file.name), image.layout,
                                            image.file.is_big_endian, image.file.name));
    }
    image.padding = padding_range(tags, image.layout, image.file.name);
    return image;
}

/// The smallest type that holds what the stored values stand for; double where they are no whole numbers.
PixelType type_of(const DicomImage& image) {
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
    for (const PixelValues& values : image.values) {
        if (values.slope != std::round(values.slope) || values.intercept != std::round(values.intercept)) {
            return PixelType::f64;
        }
        const double a = values.lut ? 0 : values(image.layout.lowest());
        const double b = values.lut ? 65535 : values(image.layout.highest());
        lowest = std::min({lowest, a, b});
        highest = std::max({highest, a, b});
    }
    const auto fits = [&](double low, double high) { return lowest >= low && highest <= high; };
    if (fits(0, 255)) return PixelType::u8;
    if (fits(-128, 127)) return PixelType::i8;
    if (fits(0, 65535)) return PixelType::u16;
    if (fits(-32768, 32767)) return PixelType::i16;
    if (fits(0, 4294967295.0)) return PixelType::u32;
    return fits(-2147483648.0, 2147483647.0) ? PixelType::i32 : PixelType::f64;
}

/// Without scaling: the type as stored.
PixelType stored_type(const PixelLayout& layout) {
    if (layout.bits_allocated == 8) return layout.is_signed ? PixelType::i8 : PixelType::u8;
    if (layout.bits_allocated == 16) return layout.is_signed ? PixelType::i16 : PixelType::u16;
    return layout.is_signed ? PixelType::i32 : PixelType::u32;
}

void note_values(const DicomImage& image, Raster& raster) {
    const PixelValues& values = image.values.front();
    if (values.lut) {
        raster.notes.push_back("Modality LUT (0028,3000) applied: " + std::to_string(values.lut->entries.size()) +
                               " entries from stored value " + number_text(values.lut->first) + ", type " +
                               (values.lut->type.empty() ? "not said" : values.lut->type));
    } else if (!values.is_identity()) {
        const auto same = [&](const PixelValues& v) {
            return v.slope == values.slope && v.intercept == values.intercept;
        };
        const bool is_one = std::ranges::all_of(image.values, same);
        raster.notes.push_back("RescaleSlope (0028,1053) = " + number_text(values.slope) +
                               " and RescaleIntercept (0028,1052) = " + number_text(values.intercept) + " applied" +
                               (is_one ? "" : " to the first frame, others to others"));
    }
}

/// Whether large values are to be shown dark, and which tags say so. MONOCHROME1 and INVERSE are one inversion, not
/// two: DICOM PS3.3 C.8.11.3 demands INVERSE of a MONOCHROME1 image, IDENTITY of a MONOCHROME2 image.
void take_polarity(const DicomImage& image, Raster& raster) {
    const DicomTags& tags = image.file.tags;
    const std::string shape = tags.text(tag::kPresentationShape);
    if (!shape.empty() && shape != "IDENTITY" && shape != "INVERSE") {
        throw bad_value("PresentationLUTShape (2050,0020)", shape, "IDENTITY or INVERSE", image.file.name);
    }
    const bool is_monochrome1 = image.layout.photometric == "MONOCHROME1";
    raster.white_is_zero = is_monochrome1 || shape == "INVERSE";
    std::string by = "PhotometricInterpretation (0028,0004) = " + image.layout.photometric;
    if (!shape.empty()) by += ", PresentationLUTShape (2050,0020) = " + shape;
    if (raster.white_is_zero) raster.shown_dark_by = by;
    if (!shape.empty() && is_monochrome1 != (shape == "INVERSE")) {
        raster.notes.push_back(by + " do not go together: large values are taken as shown dark, as one of them says");
    }
}

Raster header_of(const DicomImage& image, const std::filesystem::path& path) {
    Raster raster;
    raster.format = FileFormat::dicom;
    raster.size = {image.layout.size.x(), image.layout.size.y(), image.layout.frames};
    raster.components = image.layout.samples;
    raster.bits_stored = image.layout.bits_stored;
    const bool is_identity = std::ranges::all_of(image.values, &PixelValues::is_identity);
    raster.type = is_identity ? stored_type(image.layout) : type_of(image);
    if (const auto& lut = image.values.front().lut) raster.largest = std::ranges::max(lut->entries);
    raster.spacing_mm = {1, 1, 1};
    raster.origin_mm = {0, 0, 0};
    raster.direction = Eigen::Matrix3d::Identity();
    if (image.layout.photometric == "PALETTE COLOR") {
        throw bad_value("PhotometricInterpretation (0028,0004)", image.layout.photometric,
                        "MONOCHROME1 or MONOCHROME2 (colour is not read)", path.string());
    }
    note_values(image, raster);
    take_polarity(image, raster);
    return raster;
}

void append_values(const StoredFrame& frame, const PixelValues& values, std::size_t first, Raster& raster) {
    const auto put = [&](auto* pixels) {
        using T = std::remove_pointer_t<decltype(pixels)>;
        for (std::size_t i = 0; i < frame.values.size(); ++i)
            pixels[first + i] = static_cast<T>(values(frame.values[i]));
    };
    with_pixels(raster, [&](const auto* pixels) {
        using T = std::remove_cvref_t<decltype(*pixels)>;
        put(static_cast<T*>(static_cast<void*>(raster.bytes.data())));
    });
}

void read_frames(const DicomImage& image, Raster& raster) {
    const std::size_t frame_pixels = image.layout.frame_pixels();
    raster.bytes.resize(raster.pixel_count() * bytes_of(raster.type));
    const DicomTags& tags = image.file.tags;
    const bool has_overlay = tags.number(tag::kOverlayPosition, 0) > 0 || tags.number(tag::kOverlayBits, 1) > 1;
    const FrameDecoder decode(image.file, image.layout);
    for (int i = 0; i < image.layout.frames; ++i) {
        const std::size_t first = frame_pixels * static_cast<std::size_t>(i);
        const StoredFrame frame = stored_frame(decode(i), image.layout, image.padding, has_overlay, image.file.name);
        append_values(frame, image.of(i), first, raster);
        if (frame.is_padding.empty()) continue;
        raster.is_padding.resize(raster.pixel_count(), false);
        std::copy(frame.is_padding.begin(), frame.is_padding.end(),
                  raster.is_padding.begin() + static_cast<std::ptrdiff_t>(first));
    }
}

}  // namespace

Raster read_dicom(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    const DicomImage image = open_image(path);
    Raster raster = header_of(image, path);
    if (check) check(raster);
    if (image.layout.samples != 1) {
        throw bad_value("SamplesPerPixel (0028,0002)", std::to_string(image.layout.samples),
                        "1 (grey; colour is not read)", path.string());
    }
    read_frames(image, raster);
    return raster;
}

}  // namespace raylign::detail
