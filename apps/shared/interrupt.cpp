#include "apps/shared/interrupt.h"

#include <atomic>
#include <csignal>

namespace raylign::detail::apps {
namespace {

// A global, which the project avoids: a signal handler gets no context to find anything else by, and only a lock-free
// atomic is safe to touch in it.
std::atomic<bool> stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void note_interrupt(int) { stop_asked.store(true, std::memory_order_relaxed); }

}  // namespace

void catch_interrupts() {
    struct sigaction action {};
    action.sa_handler = note_interrupt;
    // A read or write in progress is finished, not failed. A second signal has its usual effect: the way out should a
    // step take too long.
    action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    for (const int number : {SIGINT, SIGTERM, SIGQUIT}) sigaction(number, &action, nullptr);
    struct sigaction before {};
    sigaction(SIGHUP, nullptr, &before);
    if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // else nohup wants it to go on
    // A closed pipe and a file that may not grow are errors of a writing, which say what could not be written.
    action.sa_handler = SIG_IGN;
    for (const int number : {SIGPIPE, SIGXFSZ}) sigaction(number, &action, nullptr);
}

bool interrupted() noexcept { return stop_asked.load(std::memory_order_relaxed); }

StopToken interrupt_token() { return StopToken(stop_asked); }

void stop_if_interrupted() {
    if (interrupted()) throw Interrupted("interrupted: no file was changed");
}

}  // namespace raylign::detail::apps
