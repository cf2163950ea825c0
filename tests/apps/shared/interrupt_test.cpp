#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

class Interrupt : public testing::TestWithParam<int> {};

TEST_P(Interrupt, EndsWith130AndLeavesEarlierOutputsAlone) {
    const TestFolder folder;
    const SmallCase scene(folder);
    ASSERT_EQ(scene.make_phantom().exit_code, 0);
    ASSERT_EQ(scene.simulate().exit_code, 0);
    std::filesystem::create_directory(folder.folder() / "result");
    write_text_file(folder.path("result/pose.json"), "earlier");
    // The oracle at a small step: many seconds if nobody stops it.
    const auto arguments = scene.register_arguments(
        {"--backend", "reference", "--levels", "1", "--projector", "trilinear", "--step", "1"});
    const ProgramResult result = run_raylign_and_signal(arguments, GetParam(), folder.folder() / "result");
    EXPECT_EQ(result.exit_code, 130) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr("interrupted"));
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(read_text(folder.path("result/pose.json")), "earlier");
    EXPECT_EQ(names_in(folder.folder() / "result"), std::vector<std::string>{"pose.json"});
}

INSTANTIATE_TEST_SUITE_P(Signals, Interrupt, testing::Values(SIGINT, SIGTERM, SIGHUP, SIGQUIT), [](const auto& named) {
    return named.param == SIGINT    ? "CtrlC"
           : named.param == SIGTERM ? "Terminate"
           : named.param == SIGHUP  ? "HangUp"
                                    : "Quit";
});

TEST(Killed, LeavesNothingAfterTheNextRun) {
    const TestFolder folder;
    const SmallCase scene(folder);
    ASSERT_EQ(scene.make_phantom().exit_code, 0);
    ASSERT_EQ(scene.simulate().exit_code, 0);
    const auto slow = scene.register_arguments(
        {"--backend", "reference", "--levels", "1", "--projector", "trilinear", "--step", "1"});
    EXPECT_EQ(run_raylign_and_signal(slow, SIGKILL, folder.folder() / "result").exit_code, 128 + SIGKILL);
    EXPECT_EQ(names_in(folder.folder() / "result").size(), 1u) << "the staging folder";
    EXPECT_LT(run_raylign(scene.register_arguments({"--levels", "1", "--max-iterations", "1"})).exit_code, 2);
    for (const std::string& name : names_in(folder.folder() / "result")) EXPECT_NE(name.front(), '.') << name;
}

}  // namespace
}  // namespace raylign::detail::test
