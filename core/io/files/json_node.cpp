#include "core/io/files/json_node.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include "core/io/files/file_format.h"
#include "core/io/files/regular_file.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"

namespace raylign::detail {
namespace {

using nlohmann::json;

/// Keeps the keys of the objects that are open while parsing: JSON allows a key twice and parsers keep the last,
/// silently.
class DuplicateKeys {
public:
    bool operator()(int, json::parse_event_t event, json& parsed) {
        if (event == json::parse_event_t::object_start) {
            open_.emplace_back();
        } else if (event == json::parse_event_t::object_end) {
            open_.pop_back();
        } else if (event == json::parse_event_t::key && !open_.back().insert(parsed.get<std::string>()).second) {
            duplicate_ = parsed.get<std::string>();
        }
        return true;
    }
    [[nodiscard]] const std::optional<std::string>& duplicate() const { return duplicate_; }

private:
    std::vector<std::set<std::string>> open_;
    std::optional<std::string> duplicate_;
};

/// Names of files need not be UTF-8: what is not is shown as U+FFFD.
std::string json_dump(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

std::string shown(const json& value) {
    constexpr std::size_t kLongest = 80;
    std::string text = json_dump(value);
    if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
    return text;
}

bool is_flat(const json& value) {
    return value.is_array() && std::ranges::none_of(value, [](const json& item) { return item.is_structured(); });
}

void append(std::string& text, const json& value, const std::string& indent) {
    if (!value.is_structured() || value.empty()) {
        text += json_dump(value);
        return;
    }
    const bool flat = is_flat(value);
    const std::string inner = indent + "  ";
    const std::string separator = flat ? ", " : ",\n" + inner;
    text += value.is_object() ? "{" : "[";
    if (!flat) text += "\n" + inner;
    bool first = true;
    for (auto it = value.begin(); it != value.end(); ++it) {
        if (!first) text += separator;
        first = false;
        if (value.is_object()) text += json_dump(it.key()) + ": ";
        append(text, *it, inner);
    }
    if (!flat) text += "\n" + indent;
    text += value.is_object() ? "}" : "]";
}

constexpr int kDeepestLevel = 64;  // levels; no file of this project has 10, and printing a value recurses

/// nlohmann's message without its prefix "[json.exception.parse_error.101] ", and without what it quotes at length.
std::string reason(const json::exception& failure) {
    constexpr std::size_t kLongest = 240;
    std::string message = failure.what();
    const std::size_t prefix = message.find("] ");
    if (prefix != std::string::npos) message.erase(0, prefix + 2);
    if (message.size() > kLongest) message = message.substr(0, kLongest) + "...";
    return message;
}

/// What other programs write into JSON although it has no such thing; "" where it is nothing known.
std::string hint(const std::string& text, std::size_t at) {
    std::string_view rest = std::string_view(text).substr(std::min(at, text.size()));
    if (rest.starts_with('-')) rest.remove_prefix(1);
    for (const std::string_view word : {"NaN", "nan", "Infinity", "inf", "Inf"}) {
        if (rest.starts_with(word)) return " (JSON has no " + std::string(word) + ": give a finite number)";
    }
    if (rest.starts_with("//") || rest.starts_with("/*") || rest.starts_with('#')) return " (JSON has no comments)";
    return {};
}

/// "line 3, column 14" of the last of the characters read.
std::string position(const std::string& text, std::size_t read_bytes) {
    const std::string head = text.substr(0, read_bytes);
    const std::size_t line_end = head.rfind('\n');
    return "line " + std::to_string(1 + std::ranges::count(head, '\n')) + ", column " +
           std::to_string(line_end == std::string::npos ? head.size() : head.size() - line_end - 1);
}

json parse(std::istringstream& stream, DuplicateKeys& keys, const std::string& name) {
    const auto bytes_read = [&] {
        return static_cast<std::size_t>(stream.rdbuf()->pubseekoff(0, std::ios::cur, std::ios::in));
    };
    try {
        return json::parse(stream, [&](int depth, json::parse_event_t event, json& value) {
            if (depth > kDeepestLevel) {
                throw Error(name + " is nested deeper than " + std::to_string(kDeepestLevel) + " levels at " +
                            position(stream.str(), bytes_read()));
            }
            return keys(depth, event, value);
        });
    } catch (const json::out_of_range& failure) {  // says no position; the character after the number was read, too
        throw Error(name + " is not valid JSON: " + reason(failure) + " at " +
                    position(stream.str(), bytes_read() - 1));
    } catch (const json::parse_error& failure) {  // its byte counts from 1, the last one read
        const std::size_t at = failure.byte > 0 ? failure.byte - 1 : 0;
        const std::string& text = stream.str();
        const std::string known =
            hint(text, at).empty() ? hint(text, at - std::min<std::size_t>(at, 1)) : hint(text, at);
        throw Error(name + " is not valid JSON: " + reason(failure) + known);
    } catch (const json::exception& failure) {
        throw Error(name + " is not valid JSON: " + reason(failure));
    }
}

}  // namespace

json read_json(const std::filesystem::path& path) {
    check_readable_file(path);
    std::string bytes = regular_file_bytes(path);
    refuse_utf16(bytes, path);
    // The parser takes a NUL for the end and would not look at what follows.
    const std::size_t nul = bytes.find('\0');
    if (nul != std::string::npos) {
        throw Error(path.string() + " is not valid JSON: a NUL byte at " + position(bytes, nul + 1));
    }
    std::istringstream text(std::move(bytes));
    DuplicateKeys keys;
    json parsed = parse(text, keys, path.string());
    if (keys.duplicate()) throw Error("key \"" + *keys.duplicate() + "\" is given twice in " + path.string());
    return parsed;
}

std::string json_text(const json& value) {
    std::string text;
    append(text, value, "");
    return text + "\n";
}

Error JsonNode::error(std::string_view allowed) const { return bad_value(place_, shown(*value_), allowed, file_); }

std::string JsonNode::where() const { return place_ + " of " + file_; }

void JsonNode::allow_keys(std::initializer_list<std::string_view> keys) const {
    if (!value_->is_object()) throw error("an object");
    for (const auto& [key, unused] : value_->items()) {
        if (std::ranges::find(keys, key) != keys.end()) continue;
        const std::span<const std::string_view> allowed(keys.begin(), keys.size());
        const std::string_view near = closest(key, allowed);
        const std::string place = place_ == "the file" ? key : place_ + "." + key;
        throw Error("unknown key " + place + " in " + file_ + ": " +
                    (near.empty() ? "" : "did you mean \"" + std::string(near) + "\"? ") + "allowed are " +
                    joined(allowed, ", "));
    }
}

JsonNode JsonNode::at(const std::string& key) const {
    const std::string place = place_ == "the file" ? key : place_ + "." + key;
    if (!has(key)) throw Error(place + " is missing in " + file_);
    return {value_->at(key), place, file_};
}

JsonNode JsonNode::at(std::size_t index) const {
    return {value_->at(index), place_ + "[" + std::to_string(index) + "]", file_};
}

std::size_t JsonNode::array_size() const {
    if (!value_->is_array()) throw error("an array");
    return value_->size();
}

void JsonNode::need_array(std::size_t size, std::string_view allowed) const {
    if (!value_->is_array() || value_->size() != size) throw error(allowed);
}

double JsonNode::number() const {
    if (!value_->is_number()) throw error("a number");
    const auto number = value_->get<double>();
    if (!std::isfinite(number)) throw error("a finite number");
    return number;
}

double JsonNode::positive() const {
    const double value = number();
    if (!(value > 0)) throw error("positive");
    return value;
}

std::string JsonNode::string() const {
    if (!value_->is_string()) throw error("a string");
    return value_->get<std::string>();
}

bool JsonNode::boolean() const {
    if (!value_->is_boolean()) throw error("true or false");
    return value_->get<bool>();
}

std::vector<double> JsonNode::numbers() const {
    std::vector<double> all(array_size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = at(i).number();
    return all;
}

Eigen::Vector2i JsonNode::size_px() const {
    constexpr double kLargest = 65536;  // per side; more is a slip of the pen
    const Eigen::Vector2d size = vector<2>();
    if (size.minCoeff() < 1 || size.maxCoeff() > kLargest || size != size.array().round().matrix()) {
        throw error("two integers in [1, 65536], columns and rows");
    }
    return size.cast<int>();
}

std::size_t JsonNode::one_of(std::initializer_list<std::string_view> words) const {
    const auto found = value_->is_string() ? std::ranges::find(words, value_->get<std::string>()) : words.end();
    if (found == words.end()) {
        throw error("one of " + joined(std::span<const std::string_view>(words.begin(), words.size()), ", "));
    }
    return static_cast<std::size_t>(found - words.begin());
}

void check_format_version(const JsonNode& root) {
    const JsonNode version = root.at("raylign");
    if (version.number() != 1) throw version.error("1, the version of the file format");
}

}  // namespace raylign::detail
