#pragma once

#include "apps/python/native/convert.h"
#include "raylign/options.h"
#include "raylign/tracking.h"

namespace raylign::detail::python {

/// Keys are the names of RegistrationOptions, flat ("sigma_px", "range_mm"); None means the default. Throws Error for a
/// key that there is not and a value of another type, naming it; ranges are the library's business.
[[nodiscard]] RegistrationOptions options_from(const py::dict& options);

}  // namespace raylign::detail::python
