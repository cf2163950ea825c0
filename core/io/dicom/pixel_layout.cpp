#include "core/io/dicom/pixel_layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/io/dicom/tag_numbers.h"
#include "core/io/dicom/transfer_syntax.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// A whole number of a tag within a range; `otherwise` where the tag is absent, which is an error where that is < 0.
int whole(const DicomFile& file, std::uint32_t tag, const char* name, int lowest, int highest, int otherwise = -1) {
    const std::string text = file.tags.text(tag);
    if (text.empty()) {
        if (otherwise >= 0) return otherwise;
        throw Error(std::string(name) + " is missing in " + file.name);
    }
    const std::vector<double> numbers = file.tags.numbers(tag, 1);
    const double value = numbers.empty() ? std::nan("") : numbers[0];
    if (value == std::round(value) && value >= lowest && value <= highest) return static_cast<int>(value);
    throw bad_value(name, text, "a whole number in [" + std::to_string(lowest) + ", " + std::to_string(highest) + "]",
                    file.name);
}

std::string photometric_of(const DicomFile& file, int samples) {
    constexpr std::array<std::string_view, 3> kGrey = {"MONOCHROME1", "MONOCHROME2", "PALETTE COLOR"};
    constexpr std::array<std::string_view, 7> kColour = {"RGB",     "YBR_FULL", "YBR_FULL_422",   "YBR_PARTIAL_422",
                                                         "YBR_ICT", "YBR_RCT",  "YBR_PARTIAL_420"};
    const std::string stated = file.tags.text(tag::kPhotometric);
    if (stated.empty() && samples == 1) return "MONOCHROME2";
    const bool is_known = samples == 1 ? std::ranges::find(kGrey, stated) != kGrey.end()
                                       : std::ranges::find(kColour, stated) != kColour.end();
    if (is_known) return stated;
    throw bad_value("PhotometricInterpretation (0028,0004)", stated,
                    samples == 1 ? "MONOCHROME1 or MONOCHROME2"
                                 : "one of DICOM's for " + std::to_string(samples) + " samples, such as RGB",
                    file.name);
}

void check_bits(const PixelLayout& layout, const std::string& name) {
    if (layout.bits_allocated % 8 != 0 || layout.bits_allocated == 24) {
        throw bad_value("BitsAllocated (0028,0100)", std::to_string(layout.bits_allocated), "8, 16 or 32", name);
    }
    if (layout.bits_stored > layout.bits_allocated) {
        throw bad_value("BitsStored (0028,0101)", std::to_string(layout.bits_stored),
                        "in [1, BitsAllocated = " + std::to_string(layout.bits_allocated) + "]", name);
    }
    if (layout.high_bit < layout.bits_stored - 1 || layout.high_bit >= layout.bits_allocated) {
        throw bad_value("HighBit (0028,0102)", std::to_string(layout.high_bit),
                        "BitsStored - 1 = " + std::to_string(layout.bits_stored - 1) +
                            ", below BitsAllocated = " + std::to_string(layout.bits_allocated),
                        name);
    }
}

/// Before anything is allocated: the pixels must be there.
void check_amount(const DicomFile& file, const PixelLayout& layout) {
    if (file.is_encapsulated) {
        if (file.pixel_parts.size() >= static_cast<std::size_t>(layout.frames)) return;
        throw bad_value(
            "NumberOfFrames (0028,0008)", std::to_string(layout.frames),
            "at most the number of compressed parts in the file, " + std::to_string(file.pixel_parts.size()),
            file.name);
    }
    const double needed = static_cast<double>(layout.frame_bytes()) * layout.frames;
    const std::uint64_t there = file.pixel_parts.empty() ? 0 : file.pixel_parts.front().length;
    if (static_cast<double>(there) >= needed) return;
    throw Error(file.name + " is a damaged or truncated DICOM file: pixel data of " + std::to_string(there) +
                " bytes where the tags say " + number_text(needed) + " (" + std::to_string(layout.size.x()) + " x " +
                std::to_string(layout.size.y()) + " pixels, " + std::to_string(layout.frames) + " frames)");
}

}  // namespace

double PixelLayout::lowest() const { return is_signed ? -std::ldexp(1.0, bits_stored - 1) : 0; }

double PixelLayout::highest() const { return std::ldexp(1.0, is_signed ? bits_stored - 1 : bits_stored) - 1; }

PixelLayout pixel_layout(const DicomFile& file) {
    if (!file.tags.has_pixels) throw Error(file.name + " has no pixels (PixelData (7FE0,0010))");
    constexpr int kLargest = 65535;
    PixelLayout layout;
    layout.size = {whole(file, kColumnsTag, "Columns (0028,0011)", 1, kLargest),
                   whole(file, kRowsTag, "Rows (0028,0010)", 1, kLargest)};
    layout.samples = whole(file, tag::kSamples, "SamplesPerPixel (0028,0002)", 1, 4, 1);
    layout.frames = std::max(1, whole(file, tag::kFrameCount, "NumberOfFrames (0028,0008)", 0, 1 << 30, 1));
    layout.bits_allocated = whole(file, tag::kBitsAllocated, "BitsAllocated (0028,0100)", 1, 32);
    layout.bits_stored = whole(file, tag::kBitsStored, "BitsStored (0028,0101)", 1, 32, layout.bits_allocated);
    layout.high_bit = whole(file, tag::kHighBit, "HighBit (0028,0102)", 0, 31, layout.bits_stored - 1);
    layout.is_signed = whole(file, tag::kRepresentation, "PixelRepresentation (0028,0103)", 0, 1, 0) == 1;
    layout.photometric = photometric_of(file, layout.samples);
    check_bits(layout, file.name);
    check_transfer_syntax(file);
    check_amount(file, layout);
    return layout;
}

void check_same_layout(const PixelLayout& layout, const PixelLayout& other, const std::string& name,
                       const std::string& other_name) {
    const auto size = [](const PixelLayout& of) {
        return std::to_string(of.size.x()) + " x " + std::to_string(of.size.y());
    };
    const auto must_equal = [&](const char* what, const std::string& value, const std::string& wanted) {
        if (value != wanted) throw bad_value(what, value, "like that of " + other_name + ", " + wanted, name);
    };
    const auto both = [&](const char* what, int PixelLayout::*member) {
        must_equal(what, std::to_string(layout.*member), std::to_string(other.*member));
    };
    must_equal("slice size", size(layout), size(other));
    both("SamplesPerPixel (0028,0002)", &PixelLayout::samples);
    both("BitsAllocated (0028,0100)", &PixelLayout::bits_allocated);
    both("BitsStored (0028,0101)", &PixelLayout::bits_stored);
    both("HighBit (0028,0102)", &PixelLayout::high_bit);
    must_equal("PixelRepresentation (0028,0103)", layout.is_signed ? "1" : "0", other.is_signed ? "1" : "0");
    must_equal("PhotometricInterpretation (0028,0004)", layout.photometric, other.photometric);
}

}  // namespace raylign::detail
