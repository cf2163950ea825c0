#include "core/io/volumes/label_names.h"

#include <charconv>

#include "core/io/files/text.h"

namespace raylign::detail {

LabelNames label_names_in_xml(std::string_view text) {
    constexpr std::string_view kLabel = "<Label ", kKey = "Key=\"", kBegin = "<![CDATA[", kEnd = "]]>";
    LabelNames names;
    for (std::size_t at = text.find(kLabel); at != std::string_view::npos; at = text.find(kLabel, at + 1)) {
        const std::string_view label = text.substr(at, text.find("</Label>", at) - at);
        const std::size_t key = label.find(kKey), begin = label.find(kBegin), end = label.find(kEnd);
        if (key == std::string_view::npos || begin == std::string_view::npos || end == std::string_view::npos) continue;
        if (end < begin) continue;
        std::int32_t number = 0;
        const std::string_view digits = label.substr(key + kKey.size());
        if (std::from_chars(digits.data(), digits.data() + digits.size(), number).ec != std::errc()) continue;
        const std::string_view name = label.substr(begin + kBegin.size(), end - begin - kBegin.size());
        if (!trimmed(name).empty()) names.emplace(number, trimmed(name));
    }
    return names;
}

}  // namespace raylign::detail
