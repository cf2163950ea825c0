#pragma once

#include <chrono>
#include <string>

#include "apps/shared/flags.h"
#include "raylign/registration.h"

namespace raylign::detail::apps {

/// "[#####-----]": a share, clamped to [0, 1].
[[nodiscard]] std::string bar_text(double share);

/// "[#####-----]  52%  level 2/4  cost 0.1234  3 s left": one line without control codes.
[[nodiscard]] std::string progress_line(const RegistrationProgress& progress);

/// Redraws one line on stderr where that is a terminal, and wipes it when destroyed; elsewhere, in a log, it is a line
/// every ten seconds, so that short runs stay silent.
class ProgressBar {
public:
    enum class Show { on_terminals, never };
    explicit ProgressBar(Show show);
    explicit ProgressBar(const OutputFlags& flags) : ProgressBar(show_of(flags)) {}
    [[nodiscard]] static Show show_of(const OutputFlags& flags) {
        return flags.quiet ? Show::never : Show::on_terminals;
    }

    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    void draw(const std::string& line);

private:
    bool active_, logs_;
    bool drawn_ = false;
    std::chrono::steady_clock::time_point last_{};
};

}  // namespace raylign::detail::apps
