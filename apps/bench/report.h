#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/bench/measure.h"
#include "apps/shared/invocation.h"
#include "apps/shared/manifest.h"
#include "apps/shared/options.h"

namespace raylign::detail::apps {

/// A backend by the name that it was asked for.
struct BenchBackend {
    std::string name;
    std::unique_ptr<Backend> backend;
};

/// A point of a curve: time of a pose against `what`.
struct BenchScaling {
    std::string what;
    int x = 0;
    std::string unit, backend;
    BenchPoint point;
};

/// One run of `bench`, as its reports tell it.
struct BenchRun {
    const Invocation& invocation;
    int repeats = 0, pixels = 0;
    std::vector<BenchBackend> backends = {};
    std::vector<LeftOut> left_out = {};
    std::vector<BenchRegistration> registrations = {};
    std::vector<BenchScaling> scaling = {};
    InputHashes inputs = {};
};

/// bench.json, indented. `scene`: of the registrations.
[[nodiscard]] std::string bench_json(const BenchRun& run, const BenchScene& scene);

/// A line a registration, then a line a point of scaling.
[[nodiscard]] std::string bench_table(const BenchRun& run);

}  // namespace raylign::detail::apps
