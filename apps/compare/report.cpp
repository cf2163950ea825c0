#include "apps/compare/report.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/shared/manifest.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

using Json = nlohmann::ordered_json;

/// JSON has no infinity: an engine that cannot do a thing is infinitely far from one that can.
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
        const Eigen::Matrix4d m = to_matrix(r.world_from_ct);
        Json pose = Json::array();
        for (int i = 0; i < 4; ++i) pose.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
        list.push_back({{"backend", r.backend},
                        {"start", r.start},
                        {"mtre_to_oracle_mm", r.mtre_to_oracle_mm},
                        {"mtre_to_given_mm", r.mtre_to_given_mm},
                        {"cost", finite(r.cost)},
                        {"iterations", r.iterations},
                        {"time_s", r.time_s},
                        {"world_from_ct", pose}});
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
    for (const BackendInfo& info : run.backends) report["backends"].push_back(Json::parse(backend_json(info)));
    report["machine"] = Json::parse(machine_json());
    report["inputs"] = Json::parse(inputs_json(run.files));
    report["notes"] = run.notes;
    return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string compare_table(const CompareRun& run) {
    std::string text;
    char line[640];
    std::snprintf(line, sizeof line, "%-10s %-52s %10s %10s  %s\n", "engine", "quantity", "largest", "allowed", "");
    text += line;
    std::size_t wrong = 0;
    for (const CompareRow& row : run.comparison.rows) {
        const std::string quantity = row.quantity + (row.unit.empty() ? "" : " [" + row.unit + "]");
        std::snprintf(line, sizeof line, "%-10s %-52s %10.2g %10.2g  %s\n", row.other.c_str(), quantity.c_str(),
                      row.value, row.tolerance.value, row.agrees ? "agrees" : "DISAGREES");
        text += line;
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
