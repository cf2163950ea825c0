#include "apps/bench/report.h"

#include <algorithm>

#include "apps/report_page/page_files.h"
#include "apps/shared/lines.h"
#include "apps/shared/machine.h"
#include "apps/shared/manifest.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

double step_s(const BenchRegistration& r) { return r.total_s / std::max(1, r.iterations); }

Json json_of(const BenchRegistration& r) {
    return {{"backend", r.backend},
            {"method", r.method},
            {"ok", r.ok},
            {"problem", r.problem},
            {"time_s",
             {{"prepare", r.timing.prepare_s},
              {"drr", r.timing.drr_s},
              {"gradient", r.timing.gradient_s},
              {"reduction", r.timing.reduction_s},
              {"transfer", r.timing.transfer_s},
              {"optimizer", r.optimizer_s}}},
            {"total_s", r.total_s},
            {"iterations", r.iterations},
            {"step_s", step_s(r)},
            {"evaluations", r.evaluations},
            {"linearizations", r.linearizations},
            {"bytes_to_host", r.bytes_to_host},
            {"engine_volume_bytes", r.engine_volume_bytes},
            {"initial_mtre_mm", r.initial_mtre_mm},
            {"final_mtre_mm", r.final_mtre_mm}};
}

Json json_of(const BenchScaling& s) {
    return {{"what", s.what},
            {"x", static_cast<double>(s.x)},
            {"unit", s.unit},
            {"backend", s.backend},
            {"pose_ms", s.point.pose_ms},
            {"spread_ms", s.point.spread_ms},
            {"rays", s.point.rays},
            {"engine_volume_bytes", s.point.engine_volume_bytes}};
}

template <class Item>
Json list_json(const std::vector<Item>& items) {
    Json list = Json::array();
    for (const Item& item : items) list.push_back(json_of(item));
    return list;
}

}  // namespace

std::string bench_json(const BenchRun& run, const BenchScene& scene) {
    Json report = {{"raylign", RAYLIGN_VERSION}, {"command", run.invocation.command_line}};
    report["scene"] = {{"name", scene.name},
                       {"volume_size", vector_json(scene.volume.grid.size)},
                       {"spacing_mm", vector_json(scene.volume.grid.spacing_mm)},
                       {"views", scene.views.size()},
                       {"image_size_px", {run.pixels, run.pixels}}};
    report["repeats"] = run.repeats;
    report["registrations"] = list_json(run.registrations);
    report["scaling"] = list_json(run.scaling);
    report["paper"] = Json::parse(paper_2006());
    report["peak_memory_bytes"] = peak_memory_bytes();
    report["left_out"] = Json::array();
    for (const LeftOut& other : run.left_out) {
        report["left_out"].push_back({{"backend", other.name}, {"reason", other.reason}});
    }
    report["backends"] = Json::array();
    for (const BenchBackend& backend : run.backends)
        report["backends"].push_back(backend_json(backend.backend->info()));
    report["machine"] = machine_json();
    report["inputs"] = inputs_json(run.inputs);
    return indented(report);
}

std::string bench_table(const BenchRun& run) {
    std::string text = format("%-12s %-17s %8s %8s %8s %8s %8s %6s %8s %10s %9s\n", "backend", "method", "DRR s",
                              "grad. s", "NCC s", "transf.s", "step ms", "steps", "total s", "read back", "mTRE mm");
    for (const BenchRegistration& r : run.registrations) {
        text += format("%-12s %-17s %8.3f %8.3f %8.3f %8.3f %8.2f %6d %8.3f %10lld %9.4f%s\n", r.backend.c_str(),
                       r.method.c_str(), r.timing.drr_s, r.timing.gradient_s, r.timing.reduction_s, r.timing.transfer_s,
                       1e3 * step_s(r), r.iterations, r.total_s, static_cast<long long>(r.bytes_to_host),
                       r.final_mtre_mm, r.ok ? "" : "  FAILED");
    }
    for (const BenchScaling& s : run.scaling) {
        text += format("%-12s %-10s %5d %-14s %10.3f ms a pose\n", s.backend.c_str(), s.what.c_str(), s.x,
                       s.unit.c_str(), s.point.pose_ms);
    }
    if (std::ranges::any_of(run.backends, [](const BenchBackend& b) { return b.name.starts_with("gl-2006"); })) {
        text +=
            "gl-2006 draws with fragment shaders, as the paper did. GPUs made for computing have few units for that: "
            "its "
            "times there\nsay nothing about the method.\n";
    }
    return text;
}

}  // namespace raylign::detail::apps
