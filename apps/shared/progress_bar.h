#pragma once

#include <chrono>
#include <string>

#include "raylign/registration.h"

namespace raylign::detail::apps {

/// "[#####-----]  52%  level 2/4  cost 0.1234  3 s left": one line without control codes.
[[nodiscard]] std::string progress_line(const RegistrationProgress& progress);

/// Redraws one line on stderr where that is a terminal; silent otherwise. Wipes its line when destroyed.
class ProgressBar {
public:
    enum class Show { on_terminals, never };
    explicit ProgressBar(Show show);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    void draw(const std::string& line);

private:
    bool active_;
    bool drawn_ = false;
    std::chrono::steady_clock::time_point last_{};
};

}  // namespace raylign::detail::apps
