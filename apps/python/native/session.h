#pragma once

#include <memory>
#include <mutex>

#include "apps/python/native/convert.h"
#include "raylign/backends.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::python {

/// A backend as Python holds it. What works on it locks it first: Python's threads may share one, and take turns.
struct SharedBackend {
    explicit SharedBackend(BackendChoice chosen) : choice(std::move(chosen)) {}
    BackendChoice choice;
    std::mutex busy;
};

/// Without the interpreter's lock, then alone on the backend; undone in the other order. Whoever waits for a backend
/// must not hold the interpreter's lock, or the one that works on it could not ask whether Ctrl-C was pressed.
class AtWork {
public:
    explicit AtWork(SharedBackend& backend) : alone_(backend.busy) {}

private:
    py::gil_scoped_release others_may_run_;
    std::lock_guard<std::mutex> alone_;
};

/// A Session with what it must not outlive.
class SharedSession {
public:
    SharedSession(std::shared_ptr<SharedBackend> backend, std::unique_ptr<Session> session)
        : backend_(std::move(backend)), session_(std::move(session)) {}
    ~SharedSession();
    SharedSession(const SharedSession&) = delete;
    SharedSession& operator=(const SharedSession&) = delete;

    [[nodiscard]] Session& session() { return *session_; }
    [[nodiscard]] const std::shared_ptr<SharedBackend>& backend() const { return backend_; }

private:
    std::shared_ptr<SharedBackend> backend_;
    std::unique_ptr<Session> session_;
};

}  // namespace raylign::detail::python
