#pragma once

#include <string>

#include "apps/batch/run.h"
#include "apps/shared/invocation.h"

namespace raylign::detail::apps {

/// batch.json, indented: all jobs, the doubtful ones first, then those that failed, then the others. Takes verdicts
/// from the jobs' own reports.
[[nodiscard]] std::string batch_json(const BatchPlan& plan, const BatchJournal& journal, const Invocation& invocation);
/// batch.csv: the same as a table.
[[nodiscard]] std::string batch_csv(const std::string& json);
/// What `batch` tells on stdout.
[[nodiscard]] std::string batch_summary(const std::string& json, const std::filesystem::path& folder);

}  // namespace raylign::detail::apps
