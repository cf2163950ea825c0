#include "core/io/dicom/value_representation.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// The numbers of a value, each as text.
template <typename T>
std::string numbers_as_text(const std::string& raw, bool is_big_endian) {
    std::string text;
    for (std::size_t at = 0; at + sizeof(T) <= raw.size(); at += sizeof(T)) {
        std::array<char, sizeof(T)> bytes;
        std::copy_n(raw.begin() + static_cast<std::ptrdiff_t>(at), sizeof(T), bytes.begin());
        if (is_big_endian) std::ranges::reverse(bytes);
        T number;
        std::memcpy(&number, bytes.data(), sizeof(T));
        if (at > 0) text += '\\';
        text += number_text(static_cast<double>(number));
    }
    return text;
}

struct Implicit {
    std::uint32_t tag;
    std::string_view vr;
};

// PixelPaddingValue and LUTDescriptor are US or SS by PixelRepresentation: their reader goes by that.
constexpr std::array<Implicit, 47> kImplicit = {{
    {0x00081140, "SQ"}, {0x00189329, "SQ"}, {0x00189402, "FL"}, {0x00189405, "SQ"}, {0x00189432, "SQ"},
    {0x00189462, "SQ"}, {0x00189463, "FL"}, {0x00189464, "FL"}, {0x00189465, "FL"}, {0x00189476, "SQ"},
    {0x00209057, "UL"}, {0x00209111, "SQ"}, {0x00209113, "SQ"}, {0x00209116, "SQ"}, {0x00209128, "UL"},
    {0x00209156, "US"}, {0x00209157, "UL"}, {0x00209450, "SQ"}, {0x00280002, "US"}, {0x00280006, "US"},
    {0x00280010, "US"}, {0x00280011, "US"}, {0x00280100, "US"}, {0x00280101, "US"}, {0x00280102, "US"},
    {0x00280103, "US"}, {0x00280120, "US"}, {0x00280121, "US"}, {0x00281041, "SS"}, {0x00283000, "SQ"},
    {0x00283002, "US"}, {0x00283010, "SQ"}, {0x00289110, "SQ"}, {0x00289145, "SQ"}, {0x00289443, "SQ"},
    {0x00289415, "SQ"}, {0x52009229, "SQ"}, {0x52009230, "SQ"}, {0x00700308, "SQ"}, {0x00700309, "SQ"},
    {0x0070030a, "SQ"}, {0x60000100, "US"}, {0x60000102, "US"}, {0x00189451, "SQ"}, {0x300a0140, "FL"},
    {0x300a0144, "FL"}, {0x300a014a, "FL"},
}};

}  // namespace

bool is_value_representation(std::string_view vr) {
    constexpr std::array<std::string_view, 34> kAll = {
        "AE", "AS", "AT", "CS", "DA", "DS", "DT", "FD", "FL", "IS", "LO", "LT", "OB", "OD", "OF", "OL", "OV",
        "OW", "PN", "SH", "SL", "SQ", "SS", "ST", "SV", "TM", "UC", "UI", "UL", "UN", "UR", "US", "UT", "UV"};
    return std::ranges::find(kAll, vr) != kAll.end();
}

bool has_long_length(std::string_view vr) {
    constexpr std::array<std::string_view, 13> kLong = {"OB", "OW", "OF", "OD", "OL", "OV", "SQ",
                                                        "UC", "UR", "UT", "UN", "SV", "UV"};
    return std::ranges::find(kLong, vr) != kLong.end();
}

std::string_view implicit_representation(std::uint32_t tag) {
    const auto* const found = std::ranges::find(kImplicit, tag, &Implicit::tag);
    return found == kImplicit.end() ? std::string_view() : found->vr;
}

std::string value_as_text(std::string_view vr, const std::string& raw, bool is_big_endian) {
    if (vr == "US") return numbers_as_text<std::uint16_t>(raw, is_big_endian);
    if (vr == "SS") return numbers_as_text<std::int16_t>(raw, is_big_endian);
    if (vr == "UL") return numbers_as_text<std::uint32_t>(raw, is_big_endian);
    if (vr == "SL") return numbers_as_text<std::int32_t>(raw, is_big_endian);
    if (vr == "FL") return numbers_as_text<float>(raw, is_big_endian);
    if (vr == "FD") return numbers_as_text<double>(raw, is_big_endian);
    const std::size_t end = raw.find_last_not_of(std::string_view(" \0", 2));
    return std::string(trimmed(std::string_view(raw).substr(0, end == std::string::npos ? 0 : end + 1)));
}

}  // namespace raylign::detail
