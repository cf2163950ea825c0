#include "core/io/dicom/dicom_tags.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <string_view>

#include "core/base/error.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::uint32_t kUndefinedLength = 0xffffffff, kItem = 0xfffee000, kItemEnd = 0xfffee00d,
                        kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kTransferSyntax = 0x00020010, kPixelData = 0x7fe00010;
constexpr std::uint32_t kSamples = 0x00280002, kBitsAllocated = 0x00280100, kFrames = 0x00280008,
                        kIntensitySign = 0x00281041;
constexpr std::uint32_t kLongestKept = 1 << 16;  // bytes: angles of every frame of a long run; icons are longer
constexpr int kDeepest = 32;                     // sequences within sequences

struct Encoding {
    bool is_explicit = true, is_big_endian = false;
};

struct Element {
    std::uint32_t tag = 0, length = 0;
    std::string vr;
};

class Walker {
public:
    explicit Walker(const std::filesystem::path& path)
        : file_(path, std::ios::binary), name_(path.string()), size_(std::filesystem::file_size(path)) {
        seek(132);
    }

    DicomTags walk() {
        while (position_ + 8 <= size_ && peek_group() == 2) keep(read_element({}));
        const std::string syntax = tags_.text(kTransferSyntax);
        if (syntax == "1.2.840.10008.1.2.1.99") throw Error(name_ + " is a deflated DICOM file: these are not read");
        // The elements before are explicit little endian whatever the syntax says of the rest.
        encoding_ = {syntax != "1.2.840.10008.1.2", syntax == "1.2.840.10008.1.2.2"};
        while (position_ < size_ && !tags_.has_pixels) keep(read_element(encoding_));
        return tags_;
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(name_ + " is a damaged or truncated DICOM file: " + what + " at byte " + std::to_string(position_) +
                    " of " + std::to_string(size_));
    }

    void seek(std::uint64_t position) {
        if (position > size_) fail("an element reaches beyond the end of the file");
        position_ = position;
        file_.seekg(static_cast<std::streamoff>(position));
    }

    std::string bytes(std::uint32_t count) {
        if (count > size_ - position_) fail("an element reaches beyond the end of the file");
        std::string text(count, '\0');
        if (!file_.read(text.data(), count)) fail("unreadable bytes");
        position_ += count;
        return text;
    }

    std::uint32_t integer(std::uint32_t count, bool is_big_endian) {
        const std::string raw = bytes(count);
        std::uint32_t value = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            const auto byte = static_cast<unsigned char>(raw[is_big_endian ? i : count - 1 - i]);
            value = (value << 8) | byte;
        }
        return value;
    }

    std::uint32_t peek_group() {
        const std::uint64_t before = position_;
        const std::uint32_t group = integer(2, false);
        seek(before);
        return group;
    }

    Element read_header(const Encoding& encoding) {
        Element element;
        element.tag = integer(2, encoding.is_big_endian) << 16;
        element.tag |= integer(2, encoding.is_big_endian);
        const bool is_delimiter = (element.tag >> 16) == 0xfffe;
        if (!encoding.is_explicit || is_delimiter) {
            element.length = integer(4, encoding.is_big_endian);
            return element;
        }
        element.vr = bytes(2);
        for (const char c : element.vr) {
            if (c < 'A' || c > 'Z') fail("an element without a value representation");
        }
        constexpr std::array<std::string_view, 13> kLong = {"OB", "OW", "OF", "OD", "OL", "OV", "SQ",
                                                            "UC", "UR", "UT", "UN", "SV", "UV"};
        bool is_long = false;
        for (const std::string_view vr : kLong) is_long = is_long || vr == element.vr;
        if (is_long) (void)bytes(2);
        element.length = integer(is_long ? 4 : 2, encoding.is_big_endian);
        return element;
    }

    /// Reads an element's header and stands behind its value; short values of the top level are kept by keep().
    Element read_element(const Encoding& encoding) {
        const Element element = read_header(encoding);
        if (element.length == kUndefinedLength) {
            // An element of unknown kind and length holds implicit items [DICOM PS3.5, 6.2.2].
            skip_items(element.vr == "UN" ? Encoding{false, false} : encoding);
            return element;
        }
        const bool is_short = depth_ == 0 && element.length <= kLongestKept;
        if (!is_short) seek(position_ + element.length);
        value_ = is_short ? value_text(element, encoding) : std::string();
        return element;
    }

    std::string value_text(const Element& element, const Encoding& encoding) {
        const bool is_us = element.tag == kRowsTag || element.tag == kColumnsTag || element.tag == kSamples ||
                           element.tag == kBitsAllocated;
        if (is_us && element.length == 2) return std::to_string(integer(2, encoding.is_big_endian));
        if (element.tag == kIntensitySign && element.length == 2) {
            return std::to_string(static_cast<std::int16_t>(integer(2, encoding.is_big_endian)));
        }
        const std::string raw = bytes(element.length);
        const std::size_t end = raw.find_last_not_of(std::string_view(" \0", 2));
        return std::string(trimmed(std::string_view(raw).substr(0, end == std::string::npos ? 0 : end + 1)));
    }

    /// The items of a sequence, or the fragments of compressed pixels, up to their end mark.
    void skip_items(const Encoding& encoding) {
        if (++depth_ > kDeepest) fail("sequences nested too deeply");
        for (;;) {
            const Element item = read_header(encoding);
            if (item.tag == kSequenceEnd) break;
            if (item.tag != kItem) fail("a sequence without its end mark");
            if (item.length != kUndefinedLength) {
                seek(position_ + item.length);
                continue;
            }
            while (read_element(encoding).tag != kItemEnd) {
            }
        }
        --depth_;
    }

    void keep(const Element& element) {
        if (element.tag != kPixelData) {
            if (element.length <= kLongestKept) tags_.values[element.tag] = value_;
            return;
        }
        tags_.has_pixels = true;
        const double pixels = tags_.number(kRowsTag, 0) * tags_.number(kColumnsTag, 0) * tags_.number(kSamples, 1) *
                              std::max(1.0, tags_.number(kFrames, 1));
        const double needed_bytes = pixels * tags_.number(kBitsAllocated, 16) / 8;
        if (element.length != kUndefinedLength && element.length < needed_bytes) {
            fail("pixel data of " + std::to_string(element.length) + " bytes where the tags say " +
                 number_text(needed_bytes));
        }
    }

    std::ifstream file_;
    std::string name_;
    std::uint64_t size_ = 0, position_ = 0;
    Encoding encoding_;
    int depth_ = 0;
    std::string value_;
    DicomTags tags_;
};

}  // namespace

std::string DicomTags::text(std::uint32_t tag) const {
    const auto found = values.find(tag);
    return found == values.end() ? std::string() : found->second;
}

std::vector<double> DicomTags::numbers(std::uint32_t tag, std::size_t count) const {
    std::vector<double> numbers;
    const std::string value = text(tag);
    for (const std::string_view part : split(value, '\\')) {
        const std::optional<double> number = number_from(part);
        if (number && std::isfinite(*number)) numbers.push_back(*number);
    }
    if (numbers.size() != count) numbers.clear();
    return numbers;
}

std::vector<double> DicomTags::all_numbers(std::uint32_t tag) const {
    const std::string value = text(tag);
    return value.empty() ? std::vector<double>() : numbers(tag, split(value, '\\').size());
}

double DicomTags::number(std::uint32_t tag, double otherwise) const {
    const std::vector<double> one = numbers(tag, 1);
    return one.empty() ? otherwise : one.front();
}

std::optional<DicomTags> read_dicom_tags(const std::filesystem::path& path) {
    if (!has_dicom_mark(path)) return std::nullopt;
    return Walker(path).walk();
}

}  // namespace raylign::detail
