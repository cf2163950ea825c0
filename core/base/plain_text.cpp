#include "core/base/plain_text.h"

#include <functional>

namespace raylign::detail {
namespace {

bool is_continuation(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }

/// Bytes of the character that `text` begins with; 0 where that is a control character or no UTF-8.
std::size_t shown_bytes(std::string_view text) {
    const auto first = static_cast<unsigned char>(text[0]);
    if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
    const std::size_t count = first >= 0xf0 && first <= 0xf4 ? 4 : first >= 0xe0 ? 3 : 2;
    if (first < 0xc2 || first > 0xf4 || text.size() < count) return 0;
    for (std::size_t i = 1; i < count; ++i) {
        if (!is_continuation(text[i])) return 0;
    }
    const bool is_control = first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0;  // U+0080 to U+009F
    return is_control ? 0 : count;
}

std::string escaped(char byte) {
    if (byte == '\n') return "\\n";
    if (byte == '\t') return "\\t";
    const auto value = static_cast<unsigned char>(byte);
    return {'\\', 'x', "0123456789abcdef"[value >> 4], "0123456789abcdef"[value & 15]};
}

/// `keeps_feed`: whether the line feed before this rest stays.
std::string with_escapes(std::string_view text, const std::function<bool(std::string_view)>& keeps_feed) {
    std::string plain;
    while (!text.empty()) {
        const bool is_kept_feed = text[0] == '\n' && keeps_feed(text.substr(1));
        const std::size_t count = is_kept_feed ? 1 : shown_bytes(text);
        if (count > 0) {
            plain.append(text, 0, count);
        } else {
            plain += escaped(text[0]);
        }
        text.remove_prefix(count > 0 ? count : 1);
    }
    return plain;
}

/// Without its middle where it is too long.
std::string cut(std::string text, std::size_t most) {
    if (text.size() <= most) return text;
    std::size_t head = most * 3 / 4, tail = text.size() - most / 4;
    while (head > 0 && is_continuation(text[head])) --head;
    while (tail < text.size() && is_continuation(text[tail])) ++tail;
    return text.substr(0, head) + " ... (" + std::to_string(tail - head) + " bytes left out) ... " + text.substr(tail);
}

}  // namespace

std::string plain_text(std::string_view text, std::size_t most) {
    return cut(with_escapes(text, [](std::string_view) { return false; }), most);
}

std::string plain_message(std::string_view text, std::size_t most) {
    return cut(with_escapes(text, [](std::string_view rest) { return rest.starts_with("  "); }), most);
}

std::string plain_page(std::string_view text) {
    return with_escapes(text, [](std::string_view) { return true; });
}

}  // namespace raylign::detail
