#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/register/inputs.h"
#include "apps/shared/options.h"
#include "raylign/registration.h"
#include "raylign/targets.h"

namespace raylign::detail::apps {

/// Errors against --truth.
struct TruthComparison {
    TargetErrors initial, final;
};

/// One run of `register`, as the report and the summary tell it.
struct RegisterRun {
    const RegisterOptions& options;
    const Invocation& invocation;
    const RegisterInputs& inputs;
    BackendInfo backend;
    std::vector<BackendStatus> passed_over;
    RegistrationResult result;
    std::optional<TruthComparison> truth;
    std::vector<std::string> outputs;  ///< file names in the output folder
    double total_s = 0;
};

/// report.json, indented, with a final newline.
[[nodiscard]] std::string report_json(const RegisterRun& run);

/// What `raylign info --json` prints.
[[nodiscard]] std::string info_json(const std::vector<BackendStatus>& backends);

}  // namespace raylign::detail::apps
