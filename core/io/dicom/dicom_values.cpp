#include "core/io/dicom/dicom_values.h"

#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <ctime>

namespace raylign::detail {

std::string decimal_string(double number) {
    std::array<char, 40> text;
    constexpr std::ptrdiff_t kMost = 16;
    for (int digits = 15; digits > 0; --digits) {
        const auto end = std::to_chars(text.begin(), text.end(), number, std::chars_format::general, digits).ptr;
        if (end - text.begin() <= kMost) return {text.begin(), end};
    }
    return "0";
}

std::string uid_of(const std::string& text) {
    std::array<unsigned char, SHA256_DIGEST_LENGTH> hash;
    SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), hash.data());
    hash[6] = static_cast<unsigned char>((hash[6] & 0x0f) | 0x80);  // UUID version 8: by its maker
    hash[8] = static_cast<unsigned char>((hash[8] & 0x3f) | 0x80);
    std::string digits;
    constexpr std::size_t kBytes = 16;
    const auto is_left = [&] { return std::any_of(hash.begin(), hash.begin() + kBytes, [](int b) { return b != 0; }); };
    while (is_left()) {
        int remainder = 0;
        for (std::size_t i = 0; i < kBytes; ++i) {
            const int value = remainder * 256 + hash[i];
            hash[i] = static_cast<unsigned char>(value / 10);
            remainder = value % 10;
        }
        digits += static_cast<char>('0' + remainder);
    }
    return "2.25." + std::string(digits.rbegin(), digits.rend());
}

std::string utc_now(const char* format) {
    const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    std::tm parts{};
    ::gmtime_r(&now, &parts);
    std::array<char, 32> text;
    return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

}  // namespace raylign::detail
