// The journal's lines and study.csv.

#include <charconv>
#include <cmath>
#include <limits>

#include "apps/shared/json_text.h"
#include "apps/study/trial.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace raylign::detail::apps {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Shortest text that reads back as the same number.
std::string cell_text(double value) {
    if (std::isnan(value)) return "";
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
}
std::string cell_text(std::uint64_t value) { return std::to_string(value); }
std::string cell_text(bool value) { return value ? "1" : "0"; }
std::string cell_text(const std::string& value) {
    if (value.find_first_of(",\"\n\r") == std::string::npos) return value;
    std::string quoted = "\"";
    for (const char c : value) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

/// JSON has no NaN: it is written as null.
double number_of(const Json& json) { return json.is_null() ? kNan : json.get<double>(); }

Json pose_json(const RigidTransform& pose) {
    Json numbers = Json::array();
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) numbers.push_back(pose.rotation(r, c));
        numbers.push_back(pose.translation_mm[r]);
    }
    return numbers;
}

RigidTransform pose_from(const Json& numbers) {
    RigidTransform pose;
    if (numbers.size() != 12) throw Error("a pose needs 12 numbers");
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) pose.rotation(r, c) = number_of(numbers[4 * r + c]);
        pose.translation_mm[r] = number_of(numbers[4 * r + 3]);
    }
    return pose;
}

/// Calls visit(name, member) for each plain member of a record, in the order of the CSV's columns.
template <typename Record, typename Visit>
void visit_results(Record& r, Visit visit) {
    visit("initial_mtre_mm", r.initial_mtre_mm);
    visit("initial_mrpd_mm", r.initial_mrpd_mm);
    visit("final_mtre_mm", r.final_mtre_mm);
    visit("final_mrpd_mm", r.final_mrpd_mm);
    visit("in_plane_mm", r.split.in_plane_mm);
    visit("depth_mm", r.split.depth_mm);
    visit("rotation_rad", r.split.rotation_rad);
    visit("success", r.success);
    visit("verdict_ok", r.verdict_ok);
    visit("expected_error_mm", r.expected_error_mm);
    visit("reasons", r.reasons);
    visit("error", r.error);
    visit("cost_initial", r.cost_initial);
    visit("cost_final", r.cost_final);
    visit("iterations", r.iterations);
    visit("evaluations", r.evaluations);
    visit("linearizations", r.linearizations);
    visit("bytes_to_host", r.bytes_to_host);
}

template <typename Record, typename Visit>
void visit_times(Record& r, Visit visit) {
    visit("total_s", r.total_s);
    visit("prepare_s", r.prepare_s);
    visit("drr_s", r.drr_s);
    visit("gradient_s", r.gradient_s);
    visit("reduction_s", r.reduction_s);
    visit("transfer_s", r.transfer_s);
    visit("optimizer_s", r.optimizer_s);
}

template <typename Record, typename Visit>
void visit_place(Record& r, Visit visit) {
    visit("trial", r.trial);
    visit("case", r.study_case);
    visit("interval", r.interval);
    visit("repetition", r.repetition);
    visit("seed", r.seed);
}

void read_member(const Json& json, double& value) { value = number_of(json); }
template <typename T>
void read_member(const Json& json, T& value) {
    value = json.get<T>();
}

std::string csv_header(const Study& study) {
    std::string line = "trial,views,backend,method,metric,";
    if (!study.objects.empty()) line += "object,";
    line += "low_mm,high_mm,repetition,seed";
    TrialRecord record;
    visit_results(record, [&](const char* name, auto&) { line += std::string(",") + name; });
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) line += ",world_from_ct_" + std::to_string(r) + std::to_string(c);
    }
    visit_times(record, [&](const char* name, auto&) { line += std::string(",") + name; });
    return line + "\n";
}

std::string csv_row(const Study& study, const TrialRecord& record) {
    const StudyCase& studied = study.cases[record.study_case];
    const StudyInterval& interval = study.intervals[record.interval];
    std::string line = std::to_string(record.trial);
    const auto add = [&line](const std::string& text) { line += "," + text; };
    for (const std::string& text : {joined(studied.views, "+"), studied.backend, studied.method, studied.metric}) {
        add(cell_text(text));
    }
    if (!study.objects.empty()) add(cell_text(studied.object));
    add(cell_text(interval.low_mm));
    add(cell_text(interval.high_mm));
    add(std::to_string(record.repetition));
    add(std::to_string(record.seed));
    visit_results(record, [&](const char*, const auto& value) { add(cell_text(value)); });
    for (const Json& value : pose_json(record.world_from_ct)) add(cell_text(value.get<double>()));
    visit_times(record, [&](const char*, const auto& value) { add(cell_text(value)); });
    return line + "\n";
}

}  // namespace

std::string trial_line(const TrialRecord& record) {
    Json json;
    const auto write = [&json](const char* name, const auto& value) { json[name] = value; };
    visit_place(record, write);
    visit_results(record, write);
    json["world_from_ct"] = pose_json(record.world_from_ct);
    visit_times(record, write);
    return one_line(json);
}

TrialRecord trial_from_line(const std::string& line) {
    TrialRecord record;
    try {
        const Json json = json_of_line(line);
        const auto read = [&json](const char* name, auto& value) { read_member(json.at(name), value); };
        visit_place(record, read);
        visit_results(record, read);
        record.world_from_ct = pose_from(json.at("world_from_ct"));
        visit_times(record, read);
    } catch (const Json::exception&) {  // a member is missing, or of another type
        throw Error("it is not the record of a trial");
    }
    return record;
}

std::string trials_csv(const Study& study, const std::vector<TrialRecord>& records) {
    std::string text = csv_header(study);
    for (const TrialRecord& record : records) text += csv_row(study, record);
    return text;
}

}  // namespace raylign::detail::apps
