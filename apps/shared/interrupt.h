#pragma once

namespace raylign::apps {

/// From now on SIGINT (Ctrl-C) and SIGTERM only note the wish to stop; the run ends at its next step.
void catch_interrupts();

[[nodiscard]] bool interrupted() noexcept;

/// Throws Error, kind cancelled, if a stop was asked for: called between the stages of a command.
void stop_if_interrupted();

}  // namespace raylign::apps
