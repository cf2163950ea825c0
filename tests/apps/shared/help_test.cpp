#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <sstream>

#include "raylign/version.h"
#include "tests/apps/run_program.h"

namespace raylign::detail::test {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;

TEST(Help, NamesEveryCommandOnOneScreen) {
    const ProgramResult result = run_raylign({"--help"});
    EXPECT_EQ(result.exit_code, 0);
    for (const char* command : {"register", "batch", "drr", "phantom", "geometry", "poses", "import", "info", "help"})
        EXPECT_THAT(result.out, HasSubstr(command));
    EXPECT_LE(std::count(result.out.begin(), result.out.end(), '\n'), 30);
    EXPECT_EQ(result.err, "");
}

class HelpOf : public testing::TestWithParam<const char*> {};

TEST_P(HelpOf, HasExamplesAndNoLineLongerThanAScreen) {
    const ProgramResult result = run_raylign({GetParam(), "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("Examples:\n  raylign " + std::string(GetParam())));
    EXPECT_THAT(result.out, Not(HasSubstr("\n\n\n")));
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;
}

TEST_P(HelpOf, NamesTheDefaultOfEveryOptionThatIsNotRequired) {
    const ProgramResult result = run_raylign({GetParam(), "--help"});
    std::istringstream lines(result.out);
    std::string entry;  // an option's text may run over several lines
    const auto check = [&entry] {
        if (entry.empty() || entry.find("required") != std::string::npos || entry.find("--help") != std::string::npos)
            return;
        EXPECT_THAT(entry, HasSubstr("default"));
    };
    for (std::string line; std::getline(lines, line);) {
        const bool starts = line.starts_with("  -");
        if (starts || line.empty()) check();
        if (starts || line.empty()) entry.clear();
        if (starts || !entry.empty()) entry += line + "\n";
    }
}

INSTANTIATE_TEST_SUITE_P(Commands, HelpOf,
                         testing::Values("register", "place", "batch", "drr", "phantom", "geometry", "poses", "import",
                                         "info", "help"),
                         [](const auto& named) { return std::string(named.param); });

TEST(Help, RegisterGroupsItsOptions) {
    const std::string text = run_raylign({"register", "--help"}).out;
    for (const char* group : {"\nInput:", "\nStart and geometry:", "\nMethod:", "\nBackend:", "\nOutput:"}) {
        EXPECT_THAT(text, HasSubstr(group));
    }
}

TEST(Version, NamesCommitAndOptions) {
    const ProgramResult result = run_raylign({"--version"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out,
                MatchesRegex("raylign " RAYLIGN_VERSION " \\(commit ([0-9a-f]+|unknown), .*[a-z+]+ [0-9.]+\\)\n"));
}

TEST(Info, ListsBackendsForPeople) {
    const ProgramResult result = run_raylign({"info"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("reference"));
    EXPECT_THAT(result.out, HasSubstr(RAYLIGN_VERSION));
}

TEST(Info, JsonListsBackendsWithDeviceOrReason) {
    const ProgramResult result = run_raylign({"info", "--json"});
    ASSERT_EQ(result.exit_code, 0);
    const nlohmann::json info = nlohmann::json::parse(result.out);
    EXPECT_EQ(info.at("raylign"), RAYLIGN_VERSION);
    ASSERT_FALSE(info.at("backends").empty());
    for (const nlohmann::json& backend : info.at("backends")) {
        if (backend.at("available").get<bool>()) {
            EXPECT_NE(backend.at("device"), "");
            EXPECT_GE(backend.at("threads"), 1);
        } else {
            EXPECT_NE(backend.at("reason"), "");
        }
    }
}

TEST(Usage, NoCommandIsAnError) {
    const ProgramResult result = run_raylign({});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("raylign: "));
    EXPECT_THAT(result.err, HasSubstr("--help"));
}

TEST(Usage, AnUnknownCommandListsTheValidOnes) {
    const ProgramResult result = run_raylign({"regster"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("regster"));
    for (const char* command : {"register", "drr", "phantom", "geometry", "poses", "import", "info", "help"})
        EXPECT_THAT(result.err, HasSubstr(command));
}

TEST(Usage, AnUnknownOptionIsNamed) {
    const ProgramResult result = run_raylign({"info", "--jsn"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("raylign info: "));
    EXPECT_THAT(result.err, HasSubstr("--jsn"));
}

TEST(Usage, AMissingRequiredOptionIsNamed) {
    const ProgramResult result = run_raylign({"register", "-v", "ct.mha", "-o", "result"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("raylign register: "));
    EXPECT_THAT(result.err, HasSubstr("--views"));
}

}  // namespace
}  // namespace raylign::detail::test
