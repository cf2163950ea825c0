#pragma once

#include "apps/python/native/convert.h"

namespace raylign::detail::python {

// What each file of this folder adds to the module, in the order in which the types need each other.
void bind_volume(py::module_& module);
void bind_views(py::module_& module);
void bind_phantom(py::module_& module);
void bind_session(py::module_& module);
void bind_results(py::module_& module);
void bind_registration(py::module_& module);

}  // namespace raylign::detail::python
