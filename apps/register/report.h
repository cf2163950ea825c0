#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/register/inputs.h"
#include "apps/report_page/page_script.h"
#include "apps/shared/invocation.h"
#include "apps/shared/json_text.h"
#include "raylign/backends.h"
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

// Parts of a result as report.json has them; null where there is no estimate.
[[nodiscard]] Json covariance_json(const Confidence& confidence);
[[nodiscard]] Json sigma_json(const Confidence& confidence);
[[nodiscard]] Json search_json(const SearchReport& search);

/// report.json, indented, with a final newline.
[[nodiscard]] std::string report_json(const RegisterRun& run);

/// report.html; `report`: what report_json gave; `viewer`: its part to correct the result.
[[nodiscard]] std::string register_page(const std::string& report, const std::vector<PageOverlay>& overlays,
                                        const PageScript& viewer);

}  // namespace raylign::detail::apps
