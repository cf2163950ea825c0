#pragma once

#include <memory>

#include "core/backend.h"

namespace raylign::detail {

/// The oracle: double, scalar, one thread, written to be read. Every other backend is checked against it.
[[nodiscard]] std::unique_ptr<Backend> make_reference_backend();

}  // namespace raylign::detail
