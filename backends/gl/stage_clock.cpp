#include "backends/gl/stage_clock.h"

namespace raylign::detail::gl {

void StageClock::begin() {
    if (!context_.device().software) {
        stages_.push_back(Stage::count);
        return mark();
    }
    context_.wait("starting the clock");
    last_ = Clock::now();
}

void StageClock::end(Stage stage) {
    if (!context_.device().software) {
        stages_.push_back(stage);
        return mark();
    }
    context_.wait("a stage");
    const Clock::time_point now = Clock::now();
    seconds_[static_cast<std::size_t>(stage)] += std::chrono::duration<double>(now - last_).count();
    last_ = now;
}

void StageClock::mark() {
    const std::size_t at = stages_.size() - 1;
    if (queries_.size() <= at) queries_.push_back(make_query(context_.gl(), GL_TIMESTAMP, "stage"));
    context_.gl().QueryCounter(queries_[at].id(), GL_TIMESTAMP);
}

StageSeconds StageClock::collect() {
    GLuint64 before = 0;
    for (std::size_t i = 0; i < stages_.size(); ++i) {
        GLuint64 now = 0;
        context_.gl().GetQueryObjectui64v(queries_[i].id(), GL_QUERY_RESULT, &now);
        if (stages_[i] != Stage::count) seconds_[static_cast<std::size_t>(stages_[i])] += 1e-9 * (now - before);
        before = now;
    }
    stages_.clear();
    return std::exchange(seconds_, {});
}

}  // namespace raylign::detail::gl
