#include "apps/shared/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "apps/shared/lines.h"

namespace raylign::detail::apps {
namespace {

constexpr std::chrono::seconds kLogEvery(10);  // a night's run leaves a log that can still be read

}  // namespace

std::string bar_text(double share) {
    constexpr int kWidth = 24;
    share = std::clamp(share, 0.0, 1.0);
    const auto filled = static_cast<std::size_t>(std::lround(share * kWidth));
    return "[" + std::string(filled, '#') + std::string(kWidth - filled, '-') + "]";
}

std::string progress_line(const RegistrationProgress& progress) {
    return bar_text(progress.fraction) +
           format(" %3.0f%%  level %d/%d  cost %.4f  %.0f s left", 100 * std::clamp(progress.fraction, 0.0, 1.0),
                  progress.level + 1, progress.levels, progress.cost, std::ceil(std::max(progress.remaining_s, 0.0)));
}

ProgressBar::ProgressBar(Show show)
    : active_(show == Show::on_terminals && isatty(STDERR_FILENO) == 1),
      logs_(show == Show::on_terminals && !active_),
      last_(std::chrono::steady_clock::now()) {}

ProgressBar::~ProgressBar() {
    if (drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::draw(const std::string& line) {
    const auto now = std::chrono::steady_clock::now();
    if (logs_ && now - last_ >= kLogEvery) {
        last_ = now;
        std::fprintf(stderr, "%s\n", line.c_str());
        std::fflush(stderr);
    }
    if (!active_) return;
    if (drawn_ && now - last_ < std::chrono::milliseconds(100)) return;  // faster than eyes follow only costs time
    last_ = now;
    drawn_ = true;
    std::fprintf(stderr, "\r%s\033[K", line.c_str());
    std::fflush(stderr);
}

}  // namespace raylign::detail::apps
