#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
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
    Packer& add(const std::string& text) { return add(std::string_view(text)); }
    template <typename T>
    Packer& add(const std::vector<T>& list) {
        add(list.size());
        for (const T& value : list) add(value);
        return *this;
    }
    template <typename Key, typename Value>
    Packer& add(const std::map<Key, Value>& map) {
        add(map.size());
        for (const auto& [key, value] : map) add(key).add(value);
        return *this;
    }
    Packer& add(const Eigen::MatrixXd& matrix) {
        add(matrix.rows()).add(matrix.cols());
        for (const double value : matrix.reshaped()) add(value);
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
    void take(T& value) {
        value = number<T>();
    }
    void take(std::string& value) { value = text(); }
    template <typename T>
    void take(std::vector<T>& list) {
        list.clear();
        for (auto left = number<std::size_t>(); left > 0; --left) {  // ends early where the bytes do
            T value{};
            take(value);
            list.push_back(std::move(value));
        }
    }
    template <typename Key, typename Value>
    void take(std::map<Key, Value>& map) {
        map.clear();
        for (auto left = number<std::size_t>(); left > 0; --left) {
            Key key{};
            take(key);
            take(map[key]);
        }
    }
    void take(Eigen::MatrixXd& matrix) {
        constexpr Eigen::Index kMost = 1000;  // no matrix of ours has more rows
        const auto rows = number<Eigen::Index>(), columns = number<Eigen::Index>();
        if (rows < 0 || columns < 0 || rows > kMost || columns > kMost) throw Error("a matrix of no sensible size");
        matrix.resize(rows, columns);
        for (double& value : matrix.reshaped()) take(value);
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
