#pragma once

#include <string>
#include <vector>

#include "tests/apps/run_program.h"

namespace raylign::detail::test {

/// A small spine in two views at 90 degrees, its X-rays simulated at a known pose, and a start about 6 mm away.
class SmallCase {
public:
    /// Files "spine.mha", "geometry.json", "truth.json", "start.json" and, after simulate(), "xrays/".
    explicit SmallCase(const TestFolder& folder);
    [[nodiscard]] ProgramResult make_phantom() const;
    [[nodiscard]] ProgramResult simulate() const;

    /// `register` with the volume, views, start and output folder "result"; more arguments are appended.
    [[nodiscard]] std::vector<std::string> register_arguments(const std::vector<std::string>& more = {}) const;

private:
    const TestFolder& folder_;
};

}  // namespace raylign::detail::test
