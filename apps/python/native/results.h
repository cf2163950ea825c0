#pragma once

#include "apps/python/native/convert.h"
#include "raylign/result.h"

namespace raylign::detail::python {

/// A result with what it is of, for pictures.
struct Result {
    RegistrationResult found;
    py::object volume, views, backend;
};

}  // namespace raylign::detail::python
