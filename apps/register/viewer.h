#pragma once

#include "apps/register/report.h"
#include "apps/register/scene_report.h"
#include "apps/report_page/page_script.h"

namespace raylign::detail::apps {

/// The viewer of report.html: the objects as found, to be corrected where they are looked at. Empty where it is not
/// wanted, and where this build has none.
[[nodiscard]] PageScript result_viewer(const RegisterRun& run);
[[nodiscard]] PageScript result_viewer(const SceneRun& run);

/// How to go on from what a page hands out: this command again from another start.
[[nodiscard]] GoOn register_again(const CLI::App& command, const std::filesystem::path& folder);

}  // namespace raylign::detail::apps
