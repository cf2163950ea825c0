#include "core/io/dicom/dicom_tags.h"

#include <array>
#include <cmath>
#include <fstream>
#include <string_view>

#include "core/io/dicom/dicom_file.h"
#include "core/io/dicom/value_representation.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// A file without preamble begins with the group of the file's own data, or with the identifying group.
bool begins_with_element(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 8> head{};
    if (!file.read(head.data(), head.size())) return false;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(head[i]); };
    const int group = byte(0) + 256 * byte(1), element = byte(2) + 256 * byte(3);
    const bool is_explicit = is_value_representation({head.data() + 4, 2});
    if (group == 2) return element <= 0x10 && is_explicit;
    if (group != 8 || element > 0x60) return false;
    // Implicit: the length of a short text of even length, or of the group's length.
    return is_explicit || (byte(5) == 0 && byte(6) == 0 && byte(7) == 0 && byte(4) % 2 == 0 && byte(4) <= 128);
}

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

const DicomTags* DicomTags::item(std::uint32_t sequence) const {
    const auto found = items.find(sequence);
    return found == items.end() || found->second.empty() ? nullptr : &found->second.front();
}

bool looks_like_dicom(const std::filesystem::path& path) { return has_dicom_mark(path) || begins_with_element(path); }

std::optional<DicomTags> read_dicom_tags(const std::filesystem::path& path) {
    if (!looks_like_dicom(path)) return std::nullopt;
    return open_dicom(path).tags;
}

}  // namespace raylign::detail
