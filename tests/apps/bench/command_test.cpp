#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <set>

#include "tests/apps/run_program.h"
#include "tests/support/backends.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(BenchCommand, LeavesTheRowsOfTable2ForEveryBackendAndMethod) {
    const TestFolder folder;
    const ProgramResult result = run_raylign({"bench", "--size", "32", "--pixels", "48", "--repeat", "2", "--backend",
                                              "cpu,reference", "-o", folder.path("out")});
    ASSERT_LE(result.exit_code, 1) << result.err;
    EXPECT_THAT(names_in(folder.path("out")), ElementsAre("bench.html", "bench.json"));
    const json report = json::parse(read_text(folder.path("out/bench.json")));
    ASSERT_EQ(report.at("registrations").size(), 4U);
    for (const json& run : report.at("registrations")) {
        for (const char* stage : {"drr", "gradient", "reduction", "transfer", "prepare", "optimizer"}) {
            EXPECT_GE(run.at("time_s").at(stage), 0) << stage;
        }
        EXPECT_GT(run.at("iterations"), 0);
        EXPECT_GT(run.at("total_s"), 0);
        EXPECT_TRUE(run.at("bytes_to_host").is_number());
    }
    std::set<std::string> kinds;
    for (const json& point : report.at("scaling")) {
        kinds.insert(point.at("what").get<std::string>());
        EXPECT_GT(point.at("pose_ms"), 0);
    }
    EXPECT_TRUE(kinds.contains("volume") && kinds.contains("detector") && kinds.contains("views") &&
                kinds.contains("batch"));
    EXPECT_GT(report.at("peak_memory_bytes"), 1 << 20);
    EXPECT_EQ(report.at("paper").at("totals").size(), 2U);
}

TEST(BenchCommand, RefusesSizesOutOfRange) {
    const TestFolder folder;
    for (const auto& [option, value] : {std::pair{"--size", "4"}, {"--pixels", "9999"}, {"--repeat", "0"}}) {
        const ProgramResult result = run_raylign({"bench", option, value, "-o", folder.path("out")});
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr(std::string(option) + " = " + value));
    }
}

TEST(BenchCommand, SaysThatFragmentRatesAreNotTheMethods) {
    if (!test::is_required("gl-2006")) GTEST_SKIP() << "needs OpenGL";
    const TestFolder folder;
    const ProgramResult result = run_raylign(
        {"bench", "--size", "32", "--pixels", "32", "--repeat", "1", "--backend", "gl-2006", "-o", folder.path("out")});
    EXPECT_THAT(result.out, HasSubstr("say nothing about the method")) << result.err;
}

}  // namespace
}  // namespace raylign::detail::test
