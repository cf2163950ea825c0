#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/apps/run_program.h"

namespace raylign::detail::test {
namespace {

using testing::HasSubstr;

struct TopicOfPage {
    const char *topic, *page;
};
void PrintTo(const TopicOfPage& named, std::ostream* out) { *out << named.topic; }

class HelpTopic : public testing::TestWithParam<TopicOfPage> {};

TEST_P(HelpTopic, IsTheFirstSectionOfItsPageOnOneScreen) {
    const ProgramResult result = run_raylign({"help", GetParam().topic});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::ifstream file(std::string(RAYLIGN_SOURCE_DIR) + "/docs/" + GetParam().page);
    const std::string page{std::istreambuf_iterator<char>(file), {}};
    EXPECT_THAT(page, HasSubstr("\n## In short\n\n" + result.out + "\n## "));
    std::istringstream lines(result.out);
    int count = 0;
    for (std::string line; std::getline(lines, line); ++count) EXPECT_LE(line.size(), 100U) << line;
    EXPECT_GE(count, 5);
    EXPECT_LE(count, 25);
}

INSTANTIATE_TEST_SUITE_P(Topics, HelpTopic,
                         testing::Values(TopicOfPage{"start", "start.md"}, TopicOfPage{"geometry", "geometry.md"},
                                         TopicOfPage{"method", "method.md"}, TopicOfPage{"trust", "trust.md"},
                                         TopicOfPage{"files", "formats.md"}, TopicOfPage{"limits", "limits.md"},
                                         TopicOfPage{"bones", "bones.md"}, TopicOfPage{"place", "place.md"}),
                         [](const auto& named) { return std::string(named.param.topic); });

TEST(HelpTopics, AreListed) {
    const ProgramResult result = run_raylign({"help"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("  start\n  geometry\n  method\n  trust\n  files\n  limits\n  bones\n  place\n"));
}

TEST(HelpTopics, OneThatIsNotThereIsBadUsage) {
    const ProgramResult result = run_raylign({"help", "colour"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr("raylign help: topic = colour"));
    EXPECT_THAT(result.err, HasSubstr("start, geometry, method, trust, files, limits, bones, place"));
}

}  // namespace
}  // namespace raylign::detail::test
