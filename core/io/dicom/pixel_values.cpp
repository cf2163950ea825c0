#include "core/io/dicom/pixel_values.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/io/dicom/tag_numbers.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

std::optional<double> finite(const DicomTags& tags, std::uint32_t tag, const char* name, const std::string& where) {
    if (tags.text(tag).empty()) return std::nullopt;
    const std::vector<double> numbers = tags.numbers(tag, 1);
    if (numbers.empty()) throw bad_value(name, tags.text(tag), "one finite number", where);
    return numbers[0];
}

/// A number that may be stored as US or as SS, as the layout means it.
double as_stored(double number, const PixelLayout& layout) {
    const double range = std::ldexp(1.0, layout.bits_allocated);
    const double top = layout.is_signed ? range / 2 : range;
    if (number >= top) return number - range;
    return number < top - range ? number + range : number;
}

std::vector<std::uint16_t> lut_entries(const std::string& data, std::size_t count, bool is_big_endian) {
    std::vector<std::uint16_t> entries;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(data[i])); };
    for (std::size_t i = 0; i < count; ++i) {
        const unsigned first = byte(2 * i), second = byte(2 * i + 1);
        entries.push_back(static_cast<std::uint16_t>(is_big_endian ? 256 * first + second : first + 256 * second));
    }
    return entries;
}

ModalityLut lut_of(const DicomTags& item, const PixelLayout& layout, bool is_big_endian, const std::string& where) {
    const std::vector<double> descriptor = item.numbers(tag::kLutDescriptor, 3);
    if (descriptor.empty() || descriptor[2] < 8 || descriptor[2] > 16) {
        throw bad_value("LUTDescriptor (0028,3002)", item.text(tag::kLutDescriptor),
                        "number of entries, first stored value, 8 to 16 bits", where);
    }
    const std::size_t count = descriptor[0] == 0 ? 65536 : static_cast<std::size_t>(as_stored(descriptor[0], {}));
    const std::string data = item.text(tag::kLutData);
    ModalityLut lut;
    lut.first = as_stored(descriptor[1], layout);
    lut.type = item.text(tag::kLutType);
    const bool is_bytes = descriptor[2] == 8 && (data.size() == count || data.size() == count + 1);
    if (is_bytes && count > 1) {
        for (std::size_t i = 0; i < count; ++i) lut.entries.push_back(static_cast<unsigned char>(data[i]));
    } else if (data.size() == 2 * count && count > 0) {
        lut.entries = lut_entries(data, count, is_big_endian);
    } else {
        throw bad_value("LUTData (0028,3006)", std::to_string(data.size()) + " bytes",
                        "two bytes for each of the " + std::to_string(count) + " entries of LUTDescriptor", where);
    }
    return lut;
}

}  // namespace

double ModalityLut::operator()(double stored) const {
    const double last = static_cast<double>(entries.size() - 1);
    return entries[static_cast<std::size_t>(std::clamp(stored - first, 0.0, last))];
}

PixelValues pixel_values(const DicomTags& tags, const PixelLayout& layout, bool is_big_endian,
                         const std::string& where) {
    PixelValues values;
    const std::optional<double> slope = finite(tags, tag::kSlope, "RescaleSlope (0028,1053)", where);
    const std::optional<double> intercept = finite(tags, tag::kIntercept, "RescaleIntercept (0028,1052)", where);
    if (slope.has_value() != intercept.has_value()) {
        throw Error(std::string(slope ? "RescaleIntercept (0028,1052)" : "RescaleSlope (0028,1053)") +
                    " is missing in " + where + ": must be there where the other is");
    }
    if (slope && *slope == 0) throw bad_value("RescaleSlope (0028,1053)", "0", "a number other than 0", where);
    values.is_stated = slope.has_value();
    values.slope = slope.value_or(1);
    values.intercept = intercept.value_or(0);
    values.unit = tags.text(tag::kRescaleType);
    const DicomTags* const item = tags.item(tag::kLutSequence);
    if (item == nullptr) return values;
    if (!values.is_identity()) {
        throw Error(where + " has a Modality LUT (0028,3000) and RescaleSlope = " + number_text(values.slope) +
                    ", RescaleIntercept = " + number_text(values.intercept) + ": must be one of them");
    }
    values.lut = lut_of(*item, layout, is_big_endian, where);
    return values;
}

std::optional<PaddingRange> padding_range(const DicomTags& tags, const PixelLayout& layout, const std::string& where) {
    const std::optional<double> value = finite(tags, tag::kPadding, "PixelPaddingValue (0028,0120)", where);
    if (!value) return std::nullopt;
    const double first = as_stored(*value, layout);
    const std::optional<double> limit = finite(tags, tag::kPaddingLimit, "PixelPaddingRangeLimit (0028,0121)", where);
    const double second = limit ? as_stored(*limit, layout) : first;
    return PaddingRange{std::min(first, second), std::max(first, second)};
}

StoredFrame stored_frame(const std::string& bytes, const PixelLayout& layout,
                         const std::optional<PaddingRange>& padding, bool has_overlay_bits, const std::string& where) {
    const auto width = static_cast<std::size_t>(layout.bits_allocated / 8);
    const int below = layout.high_bit + 1 - layout.bits_stored;  // bits under the value: none today, some in old files
    const std::int64_t full = std::int64_t{1} << layout.bits_allocated, range = std::int64_t{1} << layout.bits_stored;
    const auto is_padding = [&](std::int64_t value) {
        const auto number = static_cast<double>(value);
        return padding && number >= padding->lowest && number <= padding->highest;
    };
    StoredFrame frame;
    frame.values.reserve(layout.frame_pixels());
    for (std::size_t at = 0; at + width <= bytes.size(); at += width) {
        std::int64_t word = 0;
        for (std::size_t i = width; i > 0; --i) word = (word << 8) | static_cast<unsigned char>(bytes[at + i - 1]);
        const std::int64_t whole = (layout.is_signed && word >= full / 2 ? word - full : word) >> below;
        const std::int64_t bits = (word >> below) & (range - 1);
        const std::int64_t value = layout.is_signed && bits >= range / 2 ? bits - range : bits;
        if (is_padding(value) || is_padding(whole)) {
            frame.is_padding.resize(layout.frame_pixels(), false);
            frame.is_padding[frame.values.size()] = true;
        } else if (whole != value && word >> below != bits && !has_overlay_bits) {
            throw bad_value("stored value of pixel " + std::to_string(frame.values.size()), std::to_string(whole),
                            "in [" + number_text(layout.lowest()) + ", " + number_text(layout.highest()) +
                                "], as BitsStored (0028,0101) = " + std::to_string(layout.bits_stored),
                            where);
        }
        frame.values.push_back(static_cast<double>(value));
    }
    return frame;
}

}  // namespace raylign::detail
