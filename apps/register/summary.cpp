#include "apps/register/summary.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>

namespace raylign::apps {
namespace {

std::string format(const char* pattern, ...) {
    char text[256];
    va_list arguments;
    va_start(arguments, pattern);
    std::vsnprintf(text, sizeof text, pattern, arguments);
    va_end(arguments);
    return text;
}

std::string line(const char* label, const std::string& text) { return format("  %-10s", label) + text + "\n"; }

/// The update result * start^-1: shift of the object's centre and rotation vector, both along world axes.
std::string update_lines(const RegisterRun& run) {
    const RigidTransform& start = run.inputs.start_world_from_ct;
    const Eigen::Vector3d centre_ct = run.inputs.rotation_centre_ct_mm.value_or(run.inputs.volume.grid.centre_ct_mm());
    const Eigen::Vector3d shift_mm = run.result.world_from_ct * centre_ct - start * centre_ct;
    const Eigen::Vector3d turn_deg =
        log(run.result.world_from_ct * inverse(start)).head<3>() * (180 / std::numbers::pi);
    return line("moved", format("%.2f mm  (x %+.2f, y %+.2f, z %+.2f)", shift_mm.norm(), shift_mm.x(), shift_mm.y(),
                                shift_mm.z())) +
           line("turned", format("%.2f deg (x %+.2f, y %+.2f, z %+.2f)", turn_deg.norm(), turn_deg.x(), turn_deg.y(),
                                 turn_deg.z()));
}

std::string truth_line(const RegisterRun& run) {
    return line("mTRE",
                format("%.3f mm -> %.3f mm (mRPD %.3f mm, %zu targets)", run.truth->initial.mtre_mm,
                       run.truth->final.mtre_mm, run.truth->final.mean_mrpd_mm, run.inputs.targets_ct_mm.size()));
}

std::string confidence_lines(const RegistrationResult& result) {
    const Confidence& c = result.confidence;
    std::string text;
    if (c.is_estimated) {
        text += line("sigma", format("%.3f mm, %.3f deg; weakest along (%+.2f, %+.2f, %+.2f): %.3f mm",
                                     c.translation_mm, c.rotation_deg, c.weakest_direction.x(), c.weakest_direction.y(),
                                     c.weakest_direction.z(), c.weakest_mm));
        text += line("expected", format("%.3f mm (root mean square error of the object's points)", c.rim_mm));
    }
    const SearchReport& s = result.search;
    if (s.starts > 0) {
        text += line("search", format("%s: %s starts, %d refined, %d ended here, %zu rivals",
                                      std::string(search_name(s.mode)).c_str(), std::to_string(s.starts).c_str(),
                                      s.refined, s.agreeing, s.rivals.size()));
    }
    for (const std::string& decision : result.decisions) text += line("decided", decision);
    return text;
}

std::string backend_text(const BackendInfo& info) {
    std::string text = info.name + ": " + info.device;
    if (!info.instruction_set.empty()) text += ", " + info.instruction_set;
    return text + ", " + std::to_string(info.threads) + (info.threads == 1 ? " thread" : " threads");
}

}  // namespace

std::string register_summary(const RegisterRun& run) {
    const RegistrationResult& result = run.result;
    std::string text = result.ok ? "registered\n" : "DOUBTFUL: the result must not be used unchecked\n";
    for (const std::string& reason : result.reasons) text += line("why", reason);
    text += update_lines(run);
    if (std::isfinite(result.cost_final)) {
        const std::string before = std::isfinite(result.cost_initial) ? format("%.5f -> ", result.cost_initial) : "";
        text += line("cost", before + format("%.5f (%s: 0 = perfect, 1 = unrelated)", result.cost_final,
                                             run.options.metric.c_str()));
    }
    if (run.truth) text += truth_line(run);
    text += confidence_lines(result);
    const unsigned long long poses = result.counters.evaluations + result.counters.linearizations;
    text += line("time",
                 format("%.2f s (reading %.2f s), %s, %d iterations, %llu poses compared", run.total_s,
                        run.inputs.load_s, std::string(method_name(result.method)).c_str(), result.iterations, poses));
    text += line("backend", backend_text(run.backend));
    for (const BackendStatus& other : run.passed_over) text += line("not used", other.name + ": " + other.reason);
    for (const std::string& note : run.inputs.notes) text += line("note", note);
    std::string files;
    for (const std::string& name : run.outputs) files += (files.empty() ? "" : " ") + name;
    return text + line("written", run.options.output.string() + ": " + files);
}

}  // namespace raylign::apps
