#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/base/error.h"

namespace raylign::detail {

template <typename T>
concept PlainNumber = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Puts values one after the other into a text of bytes, for a process of the same program.
class Packer {
public:
    template <PlainNumber T>
    Packer& add(T value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    Packer& add(std::string_view text) {
        add(text.size());
        bytes_ += text;
        return *this;
    }
    template <PlainNumber T>
    Packer& add(const std::vector<T>& list) {
        add(list.size());
        for (const T value : list) add(value);
        return *this;
    }
    [[nodiscard]] const std::string& bytes() const { return bytes_; }

private:
    std::string bytes_;
};

/// Takes them out again in the same order. Throws Error where there are too few: the other process is not trusted.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : rest_(bytes) {}

    template <PlainNumber T>
    [[nodiscard]] T number() {
        T value{};
        std::memcpy(&value, taken(sizeof value).data(), sizeof value);
        return value;
    }
    [[nodiscard]] std::string text() { return std::string(taken(number<std::size_t>())); }
    template <PlainNumber T>
    [[nodiscard]] std::vector<T> list() {
        const auto count = number<std::size_t>();
        if (count > rest_.size() / sizeof(T)) throw Error("the answer of a file's reader is cut off");
        std::vector<T> values;
        for (std::size_t i = 0; i < count; ++i) values.push_back(number<T>());
        return values;
    }

private:
    [[nodiscard]] std::string_view taken(std::size_t count) {
        if (count > rest_.size()) throw Error("the answer of a file's reader is cut off");
        const std::string_view front = rest_.substr(0, count);
        rest_.remove_prefix(count);
        return front;
    }

    std::string_view rest_;
};

}  // namespace raylign::detail
