// `raylign study` as a user runs it: results and refusals.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/apps/study/study_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

using Study = StudyCase;

TEST_F(Study, LeavesItsFilesAndARowForEveryTrial) {
    const ProgramResult result = run("out", kSmall);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(names_in(folder.path("out")),
                ElementsAre("study.csv", "study.html", "study.journal", "study.json", "study_starts.json"));
    EXPECT_EQ(lines_of(csv("out")).size(), 1U + 2 * 2 * 3) << "header, cases x intervals x repetitions";
    EXPECT_THAT(result.out, HasSubstr("AP+LAT, cpu, auto, gc"));
}

TEST_F(Study, JsonHoldsTheStatisticsOfEveryCaseAndInterval) {
    ASSERT_EQ(run("out", kSmall).exit_code, 0);
    const json report = json::parse(read_text(folder.path("out/study.json")));
    ASSERT_EQ(report.at("cases").size(), 2U);
    for (const json& study_case : report.at("cases")) {
        ASSERT_EQ(study_case.at("intervals").size(), 2U);
        EXPECT_EQ(study_case.at("overall").at("trials"), 6);
        for (const char* key : {"mtre_mm", "mrpd_mm", "in_plane_mm", "depth_mm", "rotation_deg", "time_s",
                                "evaluations", "linearizations"}) {
            for (const char* p : {"p50", "p75", "p95", "p99", "max"}) {
                EXPECT_TRUE(study_case.at("overall").at(key).at(p).is_number()) << key << " " << p;
            }
        }
        const json& first = study_case.at("intervals").at(0);
        EXPECT_LE(first.at("success_low"), first.at("success_rate"));
        EXPECT_GE(first.at("success_high"), first.at("success_rate"));
        EXPECT_TRUE(study_case.contains("capture_range_mm"));
    }
    EXPECT_EQ(report.at("cases").at(0).at("success_means").at("error"), "mRPD");
    EXPECT_EQ(report.at("cases").at(1).at("success_means").at("error"), "mTRE");
    EXPECT_EQ(report.at("cases").at(1).at("success_means").at("below_mm"), 3.5) << "half a voxel";
    EXPECT_EQ(report.at("inputs").size(), 3U);
    EXPECT_EQ(report.at("simulated_views").size(), 2U);
}

TEST_F(Study, CasesBeginAtTheSameStartsWithinTheirIntervals) {
    ASSERT_EQ(run("out", kSmall).exit_code, 0);
    const json starts = json::parse(read_text(folder.path("out/study_starts.json"))).at("starts");
    EXPECT_EQ(starts.size(), 6U);
    std::set<double> different;
    for (const json& start : starts) {
        const double low = 10 * start.at("interval").get<double>();
        EXPECT_GE(start.at("initial_mtre_mm"), low);
        EXPECT_LT(start.at("initial_mtre_mm"), low + 10);
        different.insert(start.at("initial_mtre_mm").get<double>());
    }
    EXPECT_EQ(different.size(), 6U);
    std::map<std::string, int> seeds;
    for (const std::string& line : lines_of(read_text(folder.path("out/study.journal")))) {
        const json entry = json::parse(line);
        if (entry.contains("trial")) ++seeds[entry.at("seed").dump()];
    }
    EXPECT_EQ(seeds.size(), 6U);
    for (const auto& [seed, count] : seeds) EXPECT_EQ(count, 2) << "once per case";
}

TEST_F(Study, RunsTheSameAgainAndAnotherSeedDiffers) {
    ASSERT_EQ(run("a", kSmall).exit_code, 0);
    ASSERT_EQ(run("b", kSmall).exit_code, 0);
    std::vector<std::string> other = kSmall;
    other.insert(other.end(), {"--seed", "2"});
    ASSERT_EQ(run("c", other).exit_code, 0);
    EXPECT_EQ(results_of(csv("a")), results_of(csv("b")));
    EXPECT_NE(results_of(csv("a")), results_of(csv("c")));
    EXPECT_EQ(read_text(folder.path("a/study_starts.json")), read_text(folder.path("b/study_starts.json")));
}

TEST_F(Study, OneTrialRunAloneGivesWhatTheStudyRecorded) {
    ASSERT_EQ(run("out", kSmall).exit_code, 0);
    std::vector<std::string> alone = kSmall;
    alone.insert(alone.end(), {"--trial", "7"});
    const ProgramResult result = run("nothing", alone);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path("nothing")));
    const json again = json::parse(result.out);
    bool found = false;
    for (const std::string& line : lines_of(read_text(folder.path("out/study.journal")))) {
        const json entry = json::parse(line);
        if (!entry.contains("trial") || entry.at("trial") != 7) continue;
        found = true;
        for (const auto& [key, value] : entry.items()) {
            if (!key.ends_with("_s")) {
                EXPECT_EQ(value, again.at(key)) << key;
            }
        }
    }
    EXPECT_TRUE(found);
    alone.back() = "12";
    EXPECT_THAT(run("nothing", alone).err, HasSubstr("--trial = 12: must be in [0, 11]"));
    alone.back() = "-3";
    EXPECT_THAT(run("nothing", alone).err, HasSubstr("--trial = -3: must be in [0, 11]"));
}

TEST_F(Study, TwoBackendsAreComparedOnTheSameStarts) {
    ASSERT_EQ(run("out", {"--bins", "0:4:4", "--per-bin", "2", "--backend", "cpu,reference"}).exit_code, 2)
        << "--backend given twice";
    std::vector<std::string> list = arguments("out", {"--bins", "0:4:4", "--per-bin", "2"});
    *std::ranges::find(list, std::string("cpu")) = "cpu,reference";
    ASSERT_EQ(run_raylign(list).exit_code, 0);
    const json agreement = json::parse(read_text(folder.path("out/study.json"))).at("agreement");
    ASSERT_EQ(agreement.size(), 1U);
    EXPECT_EQ(agreement.at(0).at("trials"), 2);
    EXPECT_LT(agreement.at(0).at("poses_apart_mm").at("max"), 0.05);
    EXPECT_EQ(agreement.at(0).at("one_succeeds_other_fails"), 0);
}

TEST_F(Study, APresetSaysWhatItLeavesOutAndCanBeOverridden) {
    std::vector<std::string> list = arguments("out", {"--preset", "paper-table3", "--bins", "0:4:4", "--per-bin", "1"});
    const auto backend = std::ranges::find(list, std::string("--backend"));
    list.erase(backend, backend + 2);
    list.insert(list.end(), {"--max-iterations", "5"});
    const ProgramResult result = run_raylign(list);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(read_text(folder.path("out/study.json")));
    EXPECT_EQ(report.at("settings").at("bins"), "0:4:4");
    std::set<std::string> views, methods;
    for (const json& study_case : report.at("cases")) {
        views.insert(study_case.at("views").dump());
        methods.insert(study_case.at("method").get<std::string>());
    }
    EXPECT_EQ(views.size(), 2U) << "single view and biplane";
    EXPECT_EQ(methods, std::set<std::string>{"steepest-descent"});
}

TEST_F(Study, AnXrayModelIsUsedAndSaidWithItsValues) {
    std::vector<std::string> list = arguments("out", {"--bins", "0:4:4", "--per-bin", "2", "--xray", "flat-panel"});
    const auto noise = std::ranges::find(list, std::string("--noise"));
    list.erase(noise, noise + 2);
    const ProgramResult result = run_raylign(list);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("X-rays: X-ray model flat-panel"));
    const json report = json::parse(read_text(folder.path("out/study.json")));
    EXPECT_EQ(report.at("settings").at("xray"), "flat-panel");
    EXPECT_TRUE(report.at("settings").at("noise_photons").is_null()) << "the model's own";
    EXPECT_EQ(report.at("xray_model").at("bits"), 14);
    EXPECT_EQ(report.at("xray_model").at("spectrum").size(), 7U);
    ASSERT_EQ(run_raylign(list).exit_code, 0) << "goes on where nothing is left to do";
    list.back() = "ideal";
    EXPECT_THAT(run_raylign(list).err, HasSubstr("belongs to another study"));
}

TEST_F(Study, AnXrayModelIsHarderThanTheIdeal) {
    const std::vector<std::string> one{"--bins", "0:4:4", "--per-bin", "1"};
    ASSERT_EQ(run("ideal", one).exit_code, 0);
    std::vector<std::string> more = one;
    more.insert(more.end(), {"--xray", "c-arm"});
    ASSERT_EQ(run("c-arm", more).exit_code, 0);
    const auto cost = [this](const std::string& output) {
        for (const std::string& line : lines_of(read_text(folder.path(output + "/study.journal")))) {
            const json entry = json::parse(line);
            if (entry.contains("trial")) return entry.at("cost_final").get<double>();
        }
        return 0.0;
    };
    EXPECT_GT(cost("c-arm"), 1.5 * cost("ideal"));
}

TEST_F(Study, AnXrayModelWithNothingToSimulateIsRefused) {
    ASSERT_EQ(scene.simulate().exit_code, 0);
    std::vector<std::string> list = arguments("out", {"--xray", "c-arm"});
    *std::ranges::find(list, folder.path("geometry.json")) = folder.path("xrays/views.json");
    const ProgramResult result = run_raylign(list);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("--xray c-arm has no meaning here: every view of"));
}

TEST_F(Study, BadOptionsAreRefusedBeforeAnythingIsWritten) {
    const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
        {{"--bins", "0:2"}, "--bins = 0:2: must be LOW:STEP:HIGH"},
        {{"--bins", "0:0:20"}, "bins"},
        {{"--bins", "20:2:0"}, "bins"},
        {{"--bins", "0:2:nan"}, "--bins"},
        {{"--per-bin", "-1"}, "--per-bin = -1"},
        {{"--per-bin", "0"}, "--per-bin = 0"},
        {{"--view", "PA"}, "--view = PA: must be one of AP, LAT"},
        {{"--view", "AP,AP"}, "given once each"},
        {{"--method", "magic"}, "method = magic"},
        {{"--metric", "gc,,ncc"}, "names with commas"},
        {{"--xray", "x-ray"}, "X-ray model = x-ray: must be one of ideal, c-arm, biplane-lab, flat-panel"},
        {{"--preset", "table9"}, "--preset = table9: must be paper-table3 or paper-table4"},
    };
    for (const auto& [more, words] : cases) {
        const ProgramResult result = run("out", more);
        EXPECT_EQ(result.exit_code, 2) << words;
        EXPECT_THAT(result.err, HasSubstr(words));
        EXPECT_FALSE(std::filesystem::exists(folder.path("out"))) << words;
    }
}

}  // namespace
}  // namespace raylign::detail::test
