#pragma once

#include <stdexcept>

#include "raylign/stop.h"

namespace raylign::detail::apps {

/// Ends a command that the user interrupted: exit 130.
class Interrupted : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// From now on SIGINT (Ctrl-C), SIGTERM, SIGQUIT and SIGHUP (unless nohup ignores it) only note the wish to stop; the
/// run ends at its next step. SIGPIPE and SIGXFSZ no longer end the program.
void catch_interrupts();

[[nodiscard]] bool interrupted() noexcept;

/// The same for the library.
[[nodiscard]] StopToken interrupt_token();

/// Throws Interrupted if a stop was asked for: called between the stages of a command.
void stop_if_interrupted();

}  // namespace raylign::detail::apps
