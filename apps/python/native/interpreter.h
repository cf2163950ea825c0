#pragma once

#include <optional>

#include "apps/python/native/convert.h"

namespace raylign::detail::python {

// A thread that asks for the interpreter's lock while the interpreter ends is ended by it, in the middle of C++, which
// ends the process (std::terminate). Python's daemon threads may be at work then. So: before the interpreter ends, all
// that wait for its lock get it, and nobody asks afterwards.

/// While it lives, other threads of Python run. Where the interpreter ends meanwhile, its end never returns, but on the
/// thread that ends the interpreter.
class OthersMayRun {
public:
    OthersMayRun() : state_(PyEval_SaveThread()) {}
    ~OthersMayRun();
    OthersMayRun(const OthersMayRun&) = delete;
    OthersMayRun& operator=(const OthersMayRun&) = delete;

private:
    PyThreadState* state_;
};

/// In the middle of such work: holds the interpreter's lock, where there is an interpreter to hold it of.
class InPython {
public:
    InPython();
    ~InPython();
    InPython(const InPython&) = delete;
    InPython& operator=(const InPython&) = delete;

    /// False where the interpreter ends: then nothing of Python may be called.
    [[nodiscard]] explicit operator bool() const { return lock_.has_value(); }

private:
    std::optional<py::gil_scoped_acquire> lock_;
};

/// Lets the two above know when the interpreter ends.
void watch_the_interpreters_end();

}  // namespace raylign::detail::python
