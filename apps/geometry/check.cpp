#include "apps/geometry/check.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "apps/shared/json_text.h"
#include "apps/shared/lines.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/io/files/json_node.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail::apps {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
constexpr double kSystematic_errors = 3;  // standard errors of the mean
constexpr std::size_t kFewestCases = 3;   // fewer have no spread to speak of

/// One view of one case: rotation [deg], then shift [mm] of the world's origin.
struct CaseCorrection {
    Vector6d value, sigma;
};

struct ViewCases {
    std::string name;
    std::vector<CaseCorrection> cases;
    std::size_t missing = 0;  ///< reports that say nothing of it
};

std::vector<std::filesystem::path> reports_in(const std::string& folder) {
    const std::filesystem::path own = std::filesystem::path(folder) / "report.json";
    std::error_code error;
    if (std::filesystem::is_regular_file(own, error)) return {own};
    std::vector<std::filesystem::path> reports;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        const std::filesystem::path report = entry.path() / "report.json";
        if (std::filesystem::is_regular_file(report, error)) reports.push_back(report);
    }
    std::ranges::sort(reports);
    if (!reports.empty()) return reports;
    throw Error("--check " + folder +
                ": no report.json in it, nor in a folder in it: give folders that register wrote");
}

/// Corrections are about the object, which lies elsewhere in each case; a rig's own error is one about any fixed point.
CaseCorrection about_origin(const JsonNode& node) {
    const auto vector = [&](const char* key) { return node.at(key).vector<3>(); };
    const Eigen::Vector3d rotation_deg = vector("rotation_deg"), shift_mm = vector("translation_mm");
    const Eigen::Vector3d turn_sigma_deg = vector("rotation_sigma_deg"),
                          shift_sigma_mm = vector("translation_sigma_mm");
    const Eigen::Vector3d centre_mm = vector("centre_world_mm");
    Twist turn = Twist::Zero();
    turn.head<3>() = rotation_deg * std::numbers::pi / 180;
    CaseCorrection correction;
    correction.value << rotation_deg, shift_mm + centre_mm - exp(turn) * centre_mm;
    // The turn's own doubt moves the origin by up to its distance.
    const double lever_mm = turn_sigma_deg.norm() * std::numbers::pi / 180 * centre_mm.norm();
    correction.sigma << turn_sigma_deg, (shift_sigma_mm.array().square() + lever_mm * lever_mm).sqrt().matrix();
    return correction;
}

void append_report(const std::filesystem::path& path, std::vector<ViewCases>& all) {
    const nlohmann::json report = read_json(path);
    const JsonNode root(report, "", path.string());
    const JsonNode list = root.at("views");
    for (std::size_t v = 0; v < list.array_size(); ++v) {
        const JsonNode view = list.at(v);
        const std::string name = view.at("name").string();
        auto found = std::ranges::find(all, name, &ViewCases::name);
        if (found == all.end()) found = all.insert(all.end(), {name, {}, 0});
        // Null where it was not estimated; older reports lack it.
        const nlohmann::json& json = report.at("views").at(v);
        if (!view.has("correction") || json.at("correction").is_null()) {
            ++found->missing;
            continue;
        }
        found->cases.push_back(about_origin(view.at("correction")));
    }
}

/// Over the cases of a view.
struct Systematic {
    Vector6d mean = Vector6d::Zero(), spread = Vector6d::Zero(), error = Vector6d::Zero();
    bool is_systematic = false;
};

Systematic summary_of(const ViewCases& view) {
    Systematic s;
    const auto n = static_cast<double>(view.cases.size());
    if (view.cases.empty()) return s;
    Vector6d variance = Vector6d::Zero(), own = Vector6d::Zero();
    for (const CaseCorrection& c : view.cases) s.mean += c.value / n;
    for (const CaseCorrection& c : view.cases) {
        variance += (c.value - s.mean).cwiseAbs2() / std::max(n - 1, 1.0);
        own += c.sigma.cwiseAbs2() / n;
    }
    s.spread = variance.cwiseSqrt();
    s.error = (variance.cwiseMax(own) / n).cwiseSqrt();
    s.is_systematic =
        view.cases.size() >= kFewestCases && (s.mean.cwiseAbs().array() > kSystematic_errors * s.error.array()).any();
    return s;
}

std::string three(const Eigen::Vector3d& v, const char* unit) {
    return format("x %+.3f, y %+.3f, z %+.3f %s", v.x(), v.y(), v.z(), unit);
}

std::string view_text(const ViewCases& view) {
    const Systematic s = summary_of(view);
    std::string text = view.name + "  (" + std::to_string(view.cases.size()) +
                       (view.cases.size() == 1 ? " case" : " cases") +
                       (view.missing > 0 ? ", " + std::to_string(view.missing) + " without a correction" : "") + ")\n";
    if (view.cases.empty()) return text;
    text += line("turned by", three(s.mean.head<3>(), "degrees; spread ") + three(s.spread.head<3>(), ""), 12);
    text += line("moved by", three(s.mean.tail<3>(), "mm; spread ") + three(s.spread.tail<3>(), ""), 12);
    const std::string verdict = s.is_systematic ? "systematic: the same in all cases beyond its spread, so the camera's"
                                                  " geometry is wrong by it"
                                : view.cases.size() < kFewestCases
                                    ? "too few cases to tell a systematic error: at least 3"
                                    : "none that is the same in all cases";
    return text + line("verdict", verdict, 12);
}

Json view_json(const ViewCases& view) {
    const Systematic s = summary_of(view);
    Json json = {{"name", view.name}, {"cases", view.cases.size()}, {"without_correction", view.missing}};
    if (view.cases.empty()) return json;
    json["rotation_deg"] = {{"mean", vector_json(s.mean.head<3>())},
                            {"spread", vector_json(s.spread.head<3>())},
                            {"error", vector_json(s.error.head<3>())}};
    json["translation_mm"] = {{"mean", vector_json(s.mean.tail<3>())},
                              {"spread", vector_json(s.spread.tail<3>())},
                              {"error", vector_json(s.error.tail<3>())}};
    json["is_systematic"] = s.is_systematic;
    return json;
}

}  // namespace

std::string rig_check(const std::vector<std::string>& folders, bool as_json) {
    std::vector<std::filesystem::path> reports;
    for (const std::string& folder : folders) {
        for (std::filesystem::path& report : reports_in(folder)) reports.push_back(std::move(report));
    }
    std::vector<ViewCases> views;
    for (const std::filesystem::path& report : reports) append_report(report, views);
    if (as_json) {
        Json list = Json::array();
        for (const ViewCases& view : views) list.push_back(view_json(view));
        return indented({{"raylign", 1}, {"reports", reports.size()}, {"views", list}});
    }
    std::string text = "corrections of the cameras in world, about its origin, over " + std::to_string(reports.size()) +
                       (reports.size() == 1 ? " report\n" : " reports\n");
    for (const ViewCases& view : views) text += view_text(view);
    return text;
}

}  // namespace raylign::detail::apps
