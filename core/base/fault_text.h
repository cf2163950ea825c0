#pragma once

#include <exception>
#include <string>

namespace raylign::detail {

/// An exception in words for people, without the names of C++: what Error says, the system's reason, "not enough
/// memory"; a fault that nobody foresaw is called one.
[[nodiscard]] std::string fault_text(const std::exception& failure);

}  // namespace raylign::detail
