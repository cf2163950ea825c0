#pragma once

#include <atomic>
#include <memory>
#include <utility>

namespace raylign {

/// Tells a run that it should stop. Copies share one flag; a default one never says so. Any thread may ask.
class StopToken {
public:
    StopToken() = default;
    /// A flag that the caller keeps alive: for signal handlers, which may touch nothing but a lock-free atomic.
    explicit StopToken(const std::atomic<bool>& flag) : flag_(std::shared_ptr<void>{}, &flag) {}

    [[nodiscard]] bool stop_requested() const noexcept { return flag_ && flag_->load(std::memory_order_relaxed); }

private:
    friend class StopSource;
    explicit StopToken(std::shared_ptr<const std::atomic<bool>> flag) : flag_(std::move(flag)) {}

    std::shared_ptr<const std::atomic<bool>> flag_;
};

/// The other end: whoever holds it may stop the run, from any thread, at any time; safe in a signal handler.
class StopSource {
public:
    StopSource() : flag_(std::make_shared<std::atomic<bool>>(false)) {}

    void request_stop() noexcept { flag_->store(true, std::memory_order_relaxed); }
    [[nodiscard]] bool stop_requested() const noexcept { return flag_->load(std::memory_order_relaxed); }
    [[nodiscard]] StopToken token() const { return StopToken(flag_); }

private:
    std::shared_ptr<std::atomic<bool>> flag_;
};

}  // namespace raylign
