#include "apps/python/native/interpreter.h"

#include <atomic>
#include <chrono>
#include <thread>

namespace raylign::detail::python {
namespace {

using namespace std::chrono_literals;

/// Of the process, as the interpreter is; never destroyed, as threads may outlive main.
struct End {
    std::atomic<bool> is_near = false;
    std::atomic<std::thread::id> of;  ///< the thread that ends the interpreter, which goes on
    std::atomic<int> inside = 0;      ///< threads that have the interpreter's lock or wait for it

    /// False: the interpreter ends.
    [[nodiscard]] bool enter() {
        ++inside;
        if (!is_near || of.load() == std::this_thread::get_id()) return true;
        --inside;
        return false;
    }
};
End& the_end() {
    static End* const end = new End;  // NOLINT(cppcoreguidelines-owning-memory)
    return *end;
}

/// Called with the interpreter's lock, before threads that ask for it are ended.
void let_all_in() {
    End& end = the_end();
    end.of = std::this_thread::get_id();
    end.is_near = true;
    const py::gil_scoped_release others_may_run;
    // A callback that waits for something else must not keep the interpreter from ending.
    for (int waited = 0; end.inside > 0 && waited < 2000; ++waited) std::this_thread::sleep_for(1ms);
}

}  // namespace

OthersMayRun::~OthersMayRun() {
    End& end = the_end();
    while (!end.enter()) std::this_thread::sleep_for(1h);
    PyEval_RestoreThread(state_);
    --end.inside;
}

InPython::InPython() {
    if (the_end().enter()) lock_.emplace();
}

InPython::~InPython() {
    if (!lock_) return;
    lock_.reset();
    --the_end().inside;
}

void watch_the_interpreters_end() { py::module_::import("atexit").attr("register")(py::cpp_function(&let_all_in)); }

}  // namespace raylign::detail::python
