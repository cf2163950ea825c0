#include "apps/shared/json_text.h"

#include <algorithm>

#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

std::string without_controls(const std::string& json) {
    std::string safe;
    safe.reserve(json.size());
    for (std::size_t i = 0; i < json.size(); ++i) {
        const auto next = i + 1 < json.size() ? static_cast<unsigned char>(json[i + 1]) : 0U;
        if (json[i] == '\x7f') {
            safe += "\\u007f";
        } else if (json[i] == '\xc2' && next >= 0x80 && next < 0xa0) {
            safe += std::string("\\u00") + (next < 0x90 ? '8' : '9') + "0123456789abcdef"[next & 15];
            ++i;
        } else {
            safe += json[i];
        }
    }
    return safe;
}

/// How deep brackets stand in each other; those within strings do not count.
int nesting(const std::string& json) {
    int depth = 0, deepest = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (in_string && c == '\\') {
            ++i;
        } else if (c == '"') {
            in_string = !in_string;
        } else if (!in_string) {
            depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
            deepest = std::max(deepest, depth);
        }
    }
    return deepest;
}

}  // namespace

std::string one_line(const Json& json) {
    return without_controls(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string indented(const Json& json, int indent) {
    return without_controls(json.dump(indent, ' ', false, Json::error_handler_t::replace)) + "\n";
}

Json json_of_line(const std::string& line) {
    constexpr int kDeepest = 64;  // as for all JSON that is read
    if (nesting(line) > kDeepest) throw Error("it is nested deeper than " + std::to_string(kDeepest) + " levels");
    Json json = Json::parse(line, nullptr, false);
    if (json.is_discarded()) throw Error("it is no JSON");
    return json;
}

}  // namespace raylign::detail::apps
