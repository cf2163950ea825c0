#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/error.h"

namespace raylign::detail {

/// The values of an enumeration and their names, for command lines and reports.
template <class Value, std::size_t N>
using Names = std::array<std::pair<Value, std::string_view>, N>;

template <class Value, std::size_t N>
std::string_view name_in(const Names<Value, N>& names, Value value) {
    for (const auto& [known, name] : names) {
        if (known == value) return name;
    }
    return "unknown";
}

template <class Value, std::size_t N>
Value value_in(const Names<Value, N>& names, std::string_view what, std::string_view wanted) {
    std::string allowed;
    for (const auto& [value, name] : names) {
        if (name == wanted) return value;
        allowed += (allowed.empty() ? "one of " : ", ") + std::string(name);
    }
    throw bad_value(what, wanted, allowed);
}

}  // namespace raylign::detail
