#include "apps/batch/report.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include "apps/shared/json_text.h"
#include "apps/shared/lines.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/files/csv.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// The job's own report; null where there is none that can be read.
Json report_of(const BatchPlan& plan, const BatchJob& job) {
    const char* name = job.command == "track" ? "track.json" : "report.json";
    std::ifstream file(plan.folder / job.name / name);
    std::stringstream text;
    text << file.rdbuf();
    try {
        return json_of_line(text.str());
    } catch (const Error&) {
        return nullptr;
    }
}

const char* status_of(const BatchOutcome* outcome) {
    if (outcome == nullptr) return "open";
    return outcome->exit_code == 0 ? "ok" : outcome->exit_code == 1 ? "doubtful" : "failed";
}

Json job_json(const BatchPlan& plan, const BatchJob& job, const BatchOutcome* outcome) {
    Json json{{"name", job.name}, {"command", job.command}, {"status", status_of(outcome)}};
    json["exit_code"] = outcome == nullptr ? Json(nullptr) : Json(outcome->exit_code);
    json["time_s"] = outcome == nullptr ? Json(nullptr) : Json(outcome->time_s);
    json["reasons"] = Json::array();
    for (const char* key : {"cost", "expected_error_mm", "page"}) json[key] = nullptr;
    if (outcome == nullptr) return json;
    if (outcome->exit_code > 1) {
        json["reasons"].push_back(outcome->problem);
        return json;
    }
    const bool is_track = job.command == "track";
    json["page"] = job.name + (is_track ? "/track.html" : "/report.html");
    const Json report = report_of(plan, job);
    if (!report.is_object()) return json;
    json["reasons"] = report.at("verdict").at("reasons");
    if (is_track) return json;
    json["cost"] = report.at("cost").at("final");
    if (report.contains("sigma") && report.at("sigma").is_object()) {
        json["expected_error_mm"] = report.at("sigma").at("expected_error_mm");
    }
    return json;
}

int rank_of(const std::string& status) {
    constexpr std::array<const char*, 4> kOrder{"doubtful", "failed", "ok", "open"};
    return static_cast<int>(std::ranges::find(kOrder, status) - kOrder.begin());
}

std::string cell(const Json& value) {
    std::string text;
    if (value.is_array()) {
        for (const Json& item : value) text += (text.empty() ? "" : "; ") + item.get<std::string>();
    } else if (!value.is_null()) {
        text = value.is_string() ? value.get<std::string>() : one_line(value);
    }
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c == '\n' || c == '\r' ? ' ' : c);
    return quoted + "\"";
}

}  // namespace

std::string batch_json(const BatchPlan& plan, const BatchJournal& journal, const Invocation& invocation) {
    std::vector<Json> jobs;
    for (const BatchJob& job : plan.jobs) jobs.push_back(job_json(plan, job, journal.find(job)));
    std::ranges::stable_sort(jobs, {}, [](const Json& job) { return rank_of(job.at("status").get<std::string>()); });
    Json json{{"raylign", RAYLIGN_VERSION}, {"command", invocation.command_line}};
    for (const char* status : {"ok", "doubtful", "failed", "open"}) {
        json["jobs_by_status"][status] =
            std::ranges::count_if(jobs, [&](const Json& job) { return job.at("status") == status; });
    }
    json["jobs"] = jobs;
    return indented(json);
}

std::string batch_csv(const std::string& json) {
    constexpr std::array<const char*, 8> kColumns{"name", "command",           "status", "exit_code",
                                                  "cost", "expected_error_mm", "time_s", "reasons"};
    std::string text;
    for (const char* column : kColumns) text += (text.empty() ? "" : ",") + std::string(column);
    text += "\n";
    const Json report = json_of_line(json);
    for (const Json& job : report.at("jobs")) {
        std::string line;
        for (const char* column : kColumns) line += (column == kColumns.front() ? "" : ",") + cell(job.at(column));
        text += line + "\n";
    }
    return text;
}

std::string batch_summary(const std::string& json, const std::filesystem::path& folder) {
    constexpr std::size_t kMost = 10;
    const Json report = json_of_line(json);
    std::string counts;
    for (const auto& [status, count] : report.at("jobs_by_status").items()) {
        if (count != 0) counts += (counts.empty() ? "" : ", ") + one_line(count) + " " + status;
    }
    std::string text = counts + "\n";
    std::size_t shown = 0;
    for (const Json& job : report.at("jobs")) {
        const std::string status = job.at("status").get<std::string>();
        if ((status != "doubtful" && status != "failed") || ++shown > kMost) continue;
        text += line(status, job.at("name").get<std::string>() + ": " + cell(job.at("reasons")));
    }
    if (shown > kMost) text += line("more", std::to_string(shown - kMost) + " more, see batch.csv");
    return text + line("written", folder.string() + ": batch.json batch.csv batch.html");
}

}  // namespace raylign::detail::apps
