#include "apps/compare/report.h"

#include <cmath>

#include "apps/shared/lines.h"
#include "apps/shared/manifest.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// JSON has no infinity: a backend that cannot do a thing is infinitely far from one that can.
Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json rows_json(const Comparison& comparison) {
    Json list = Json::array();
    for (const CompareRow& row : comparison.rows) {
        list.push_back({{"step", row.step},
                        {"quantity", row.quantity},
                        {"oracle", row.oracle},
                        {"other", row.other},
                        {"unit", row.unit},
                        {"value", finite(row.value)},
                        {"rms", finite(row.rms)},
                        {"tolerance", row.tolerance.value},
                        {"reason", row.tolerance.reason},
                        {"agrees", row.agrees},
                        {"where", row.where}});
    }
    return list;
}

Json sweeps_json(const Comparison& comparison) {
    Json list = Json::array();
    for (const CompareSweep& sweep : comparison.sweeps) {
        list.push_back({{"backend", sweep.backend},
                        {"parameter", sweep.parameter},
                        {"unit", sweep.unit},
                        {"offsets", sweep.offsets},
                        {"costs", sweep.costs},
                        {"minimum", finite(sweep.minimum)}});
    }
    return list;
}

Json registrations_json(const Comparison& comparison) {
    Json list = Json::array();
    for (const CompareRegistration& r : comparison.registrations) {
        list.push_back({{"backend", r.backend},
                        {"start", r.start},
                        {"mtre_to_oracle_mm", r.mtre_to_oracle_mm},
                        {"mtre_to_given_mm", r.mtre_to_given_mm},
                        {"cost", finite(r.cost)},
                        {"iterations", r.iterations},
                        {"time_s", r.time_s},
                        {"world_from_ct", matrix_json(r.world_from_ct)}});
    }
    return list;
}

}  // namespace

std::string compare_json(const CompareRun& run) {
    Json report = {{"raylign", RAYLIGN_VERSION},
                   {"command", run.invocation.command_line},
                   {"agrees", run.comparison.agrees()},
                   {"seed", run.options.seed},
                   {"settings",
                    {{"poses", run.options.poses},
                     {"spread_mm", run.options.spread_mm},
                     {"longest_side_px", run.options.longest_side_px},
                     {"full_size_poses", run.options.full_size_poses},
                     {"registrations", run.options.registrations},
                     {"start_mtre_mm", run.options.start_mtre_mm},
                     {"projector", projector_name(run.options.render.projector)},
                     {"metric", metric_name(run.options.similarity.metric)},
                     {"method", method_name(run.options.method)}}},
                   {"simulation", run.simulation}};
    report["rows"] = rows_json(run.comparison);
    report["sweeps"] = sweeps_json(run.comparison);
    report["registrations"] = registrations_json(run.comparison);
    report["backends"] = Json::array();
    for (const BackendInfo& info : run.backends) report["backends"].push_back(backend_json(info));
    report["machine"] = machine_json();
    report["inputs"] = inputs_json(run.hashes);
    report["notes"] = run.notes;
    return indented(report);
}

std::string compare_table(const CompareRun& run) {
    std::string text = format("%-10s %-52s %10s %10s  %s\n", "backend", "quantity", "largest", "allowed", "");
    std::size_t wrong = 0;
    for (const CompareRow& row : run.comparison.rows) {
        const std::string quantity = row.quantity + (row.unit.empty() ? "" : " [" + row.unit + "]");
        text += format("%-10s %-52s %10.2g %10.2g  %s\n", row.other.c_str(), quantity.c_str(), row.value,
                       row.tolerance.value, row.agrees ? "agrees" : "DISAGREES");
        if (row.agrees) continue;
        ++wrong;
        text += "           at " + row.where + "; allowed because: " + row.tolerance.reason + "\n";
    }
    const std::size_t all = run.comparison.rows.size();
    return text +
           (wrong == 0 ? "all " + std::to_string(all) + " comparisons agree with " + run.backends.front().name
                       : std::to_string(wrong) + " of " + std::to_string(all) + " comparisons DISAGREE with " +
                             run.backends.front().name) +
           "\n";
}

}  // namespace raylign::detail::apps
