#pragma once

#include <array>
#include <vector>

#include "backends/gl/context.h"
#include "core/base/clock.h"

namespace raylign::detail::gl {

enum class Stage { drr, gradient, reduction, count };
using StageSeconds = std::array<double, static_cast<std::size_t>(Stage::count)>;

/// Seconds per stage: by timer queries on hardware, which cost next to nothing; on software OpenGL, whose timer queries
/// lie (0 ms for 150 ms of work), by the wall clock around fences.
class StageClock {
public:
    explicit StageClock(Context& context) : context_(context) {}

    void begin();
    /// What was submitted since the last begin() or end() belongs to `stage`.
    void end(Stage stage);
    /// What the host did for `stage`.
    void add(Stage stage, double seconds) { seconds_[static_cast<std::size_t>(stage)] += seconds; }
    /// Seconds since the last collect(). The device must be done (Context::wait).
    [[nodiscard]] StageSeconds collect();

private:
    void mark();

    Context& context_;
    std::vector<Query> queries_;
    std::vector<Stage> stages_;  ///< of queries_[i + 1]; Stage::count = a begin()
    StageSeconds seconds_{};
    Clock::time_point last_;
};

}  // namespace raylign::detail::gl
