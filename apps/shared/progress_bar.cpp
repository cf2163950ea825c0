#include "apps/shared/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace raylign::detail::apps {

std::string progress_line(const RegistrationProgress& progress) {
    constexpr int kWidth = 24;
    const double fraction = std::clamp(progress.fraction, 0.0, 1.0);
    const int filled = static_cast<int>(std::lround(fraction * kWidth));
    const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '-');
    char text[160];
    std::snprintf(text, sizeof text, "[%s] %3.0f%%  level %d/%d  cost %.4f  %.0f s left", bar.c_str(), 100 * fraction,
                  progress.level + 1, progress.levels, progress.cost, std::ceil(std::max(progress.remaining_s, 0.0)));
    return text;
}

ProgressBar::ProgressBar(Show show) : active_(show == Show::on_terminals && isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
    if (drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::draw(const std::string& line) {
    if (!active_) return;
    const auto now = std::chrono::steady_clock::now();
    if (drawn_ && now - last_ < std::chrono::milliseconds(100)) return;  // faster than eyes follow only costs time
    last_ = now;
    drawn_ = true;
    std::fprintf(stderr, "\r%s\033[K", line.c_str());
    std::fflush(stderr);
}

}  // namespace raylign::detail::apps
