#include "apps/register/summary.h"

#include "apps/shared/lines.h"
#include "core/base/number_text.h"
#include "core/base/text.h"

namespace raylign::detail::apps {
namespace {

std::string truth_line(const RegisterRun& run) {
    return line("mTRE", fixed(run.truth->initial.mtre_mm, 3) + " mm -> " + fixed(run.truth->final.mtre_mm, 3) +
                            " mm (mRPD " + fixed(run.truth->final.mean_mrpd_mm, 3) + " mm, " +
                            std::to_string(run.inputs.targets_ct_mm.size()) + " targets)");
}

std::string backend_text(const BackendInfo& info) {
    std::string text = info.name + ": " + info.device;
    if (!info.instruction_set.empty()) text += ", " + info.instruction_set;
    return text + ", " + std::to_string(info.threads) + (info.threads == 1 ? " thread" : " threads");
}

}  // namespace

std::string register_summary(const RegisterRun& run) {
    std::string text = full(run.result);
    if (run.truth) text += truth_line(run);
    text += line("all", fixed(run.total_s, 2) + " s, of which reading " + fixed(run.inputs.load_s, 2) + " s");
    text += line("backend", backend_text(run.backend));
    for (const BackendStatus& other : run.passed_over) text += line("not used", other.name + ": " + other.reason);
    for (const std::string& note : run.inputs.notes) text += line("note", note);
    return text + line("written", run.options.output.folder.string() + ": " + joined(run.outputs, " "));
}

}  // namespace raylign::detail::apps
