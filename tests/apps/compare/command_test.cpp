#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

class CompareCommand : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(run_raylign({"phantom", "spine", "--size", "32", "--spacing", "7", "-o", folder.path("spine.mha")})
                      .exit_code,
                  0);
    }
    [[nodiscard]] ProgramResult run(const std::vector<std::string>& more = {}) const {
        std::vector<std::string> list{"compare",
                                      "-v",
                                      folder.path("spine.mha"),
                                      "--attenuation",
                                      "--views",
                                      folder.path("geometry.json"),
                                      "--pose",
                                      folder.path("truth.json"),
                                      "--poses",
                                      "3",
                                      "--longest-side",
                                      "32",
                                      "--registrations",
                                      "1",
                                      "-o",
                                      folder.path("out")};
        list.insert(list.end(), more.begin(), more.end());
        return run_raylign(list);
    }

    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(CompareCommand, CpuAgreesWithTheReferenceAndTheReportsSaySo) {
    const ProgramResult result = run({"--backends", "cpu,reference"});
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr("comparisons agree with reference"))
        << "reference is the oracle wherever it stands";
    EXPECT_THAT(names_in(folder.path("out")), ElementsAre("compare.html", "compare.json"));
    const json report = json::parse(read_text(folder.path("out/compare.json")));
    EXPECT_EQ(report.at("agrees"), true);
    EXPECT_EQ(report.at("backends").at(0).at("name"), "reference");
    for (const json& row : report.at("rows")) {
        EXPECT_FALSE(row.at("reason").get<std::string>().empty()) << row;
        EXPECT_LE(row.at("value"), row.at("tolerance"));
    }
    EXPECT_EQ(report.at("sweeps").size(), 12U);
    EXPECT_EQ(report.at("registrations").size(), 2U);
}

TEST_F(CompareCommand, BadInputIsRefused) {
    EXPECT_THAT(run({"--backends", "cpu"}).err, HasSubstr("at least two backends"));
    EXPECT_THAT(run({"--backends", "cpu,nonsense"}).err, HasSubstr("backend = nonsense"));
    EXPECT_THAT(run({"--backends", "cpu,cpu"}).err, HasSubstr("given once each"));
    const ProgramResult spread = run({"--backends", "cpu,reference", "--spread", "-1"});
    EXPECT_EQ(spread.exit_code, 2);
    EXPECT_THAT(spread.err, HasSubstr("spread_mm = -1"));
    EXPECT_FALSE(std::filesystem::exists(folder.path("out")));
}

}  // namespace
}  // namespace raylign::detail::test
