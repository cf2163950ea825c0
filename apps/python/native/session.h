#pragma once

#include <memory>
#include <mutex>
#include <span>

#include "apps/python/native/interpreter.h"
#include "raylign/backends.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::python {

/// A backend as Python holds it. What works on it locks it first: Python's threads may share one, and take turns. The
/// thread that works may come back, from on_progress, a signal's handler, or as it collects a session that nobody
/// needs.
struct SharedBackend {
    explicit SharedBackend(BackendChoice chosen) : choice(std::move(chosen)) {}
    BackendChoice choice;
    std::recursive_mutex busy;
};

/// Without the interpreter's lock, then alone on the backend; undone in the other order. Whoever waits for a backend
/// must not hold the interpreter's lock, or the one that works on it could not ask whether Ctrl-C was pressed.
class AtWork {
public:
    explicit AtWork(SharedBackend& backend) : alone_(backend.busy) {}

private:
    OthersMayRun others_may_run_;
    std::lock_guard<std::recursive_mutex> alone_;
};

/// A Session with what it must not outlive, and its cameras.
class SharedSession {
public:
    SharedSession(std::shared_ptr<SharedBackend> backend, std::unique_ptr<Session> session, std::span<const View> views)
        : backend_(std::move(backend)), session_(std::move(session)) {
        for (const View& view : views) cameras_.push_back(view.geometry);
    }
    ~SharedSession();
    SharedSession(const SharedSession&) = delete;
    SharedSession& operator=(const SharedSession&) = delete;

    /// For work under AtWork only, but view_count, which never changes.
    [[nodiscard]] Session& session() { return *session_; }
    [[nodiscard]] const std::vector<ViewGeometry>& cameras() const { return cameras_; }
    [[nodiscard]] const std::shared_ptr<SharedBackend>& backend() const { return backend_; }

private:
    std::shared_ptr<SharedBackend> backend_;
    std::unique_ptr<Session> session_;
    std::vector<ViewGeometry> cameras_;
};

}  // namespace raylign::detail::python
