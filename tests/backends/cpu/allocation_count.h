#pragma once

#include <cstddef>

namespace raylign::detail::test {

/// Calls of operator new by this thread so far. The program's operator new is replaced in allocation_count.cpp.
[[nodiscard]] std::size_t allocation_count();

}  // namespace raylign::detail::test
