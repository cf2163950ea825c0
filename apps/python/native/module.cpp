#include "apps/python/native/bind.h"
#include "apps/python/native/interpreter.h"
#include "raylign/error.h"
#include "raylign/version.h"

namespace raylign::detail::python {
namespace {

/// raylign.Error is a ValueError, raylign.Unavailable a RuntimeError: the same words as the program's.
void bind_errors(py::module_& module) {
    static py::handle error = py::exception<Error>(module, "Error", PyExc_ValueError).release();
    static py::handle unavailable = py::exception<Error>(module, "Unavailable", PyExc_RuntimeError).release();
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Error& what) {
            const py::handle& type = what.kind() == ErrorKind::unavailable ? unavailable : error;
            PyErr_SetString(type.ptr(), what.what());
        }
    });
    const py::handle interrupted = PyErr_NewExceptionWithDoc(
        "raylign._native.Interrupted", "Ctrl-C during a run; .result is the best that was found until then.",
        PyExc_KeyboardInterrupt, nullptr);
    module.attr("Interrupted") = py::reinterpret_steal<py::object>(interrupted);
}

}  // namespace
}  // namespace raylign::detail::python

PYBIND11_MODULE(_native, module) {
    using namespace raylign::detail::python;
    module.attr("__version__") = raylign::version();
    watch_the_interpreters_end();
    bind_errors(module);
    bind_volume(module);
    bind_views(module);
    bind_phantom(module);
    bind_session(module);
    bind_results(module);
    bind_registration(module);
}
