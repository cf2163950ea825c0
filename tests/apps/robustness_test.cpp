#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

class Robustness : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(scene.make_phantom().exit_code, 0);
        ASSERT_EQ(scene.simulate().exit_code, 0);
    }
    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(Robustness, AnOutputThatNobodyHearsCostsNoResult) {
    for (const DeadOutput output : {DeadOutput::closed, DeadOutput::broken_pipe}) {
        const ProgramResult result =
            run_raylign_unheard(scene.register_arguments({"--levels", "1", "--max-iterations", "1"}), output);
        EXPECT_EQ(result.exit_code, 4) << result.err;
        EXPECT_THAT(result.err, AllOf(HasSubstr("raylign register: standard output cannot be written: "),
                                      HasSubstr("all else is done")));
        EXPECT_EQ(json::parse(read_text(folder.path("result/report.json"))).at("seed"), 1);
        std::filesystem::remove_all(folder.path("result"));
    }
}

TEST_F(Robustness, AnInputThatGoesDuringTheRunIsHashedAsItWasRead) {
    const auto arguments = scene.register_arguments({"--levels", "1", "--max-iterations", "1"});
    ASSERT_LT(run_raylign(arguments).exit_code, 2);
    const json before = json::parse(read_text(folder.path("result/report.json"))).at("inputs");
    std::filesystem::remove_all(folder.path("result"));
    const auto is_running = [&] { return std::filesystem::exists(folder.path("result")); };
    const ProgramResult result = run_raylign_and(arguments, is_running, [&](int) {
        std::filesystem::remove(folder.path("start.json"));
        write_text_file(folder.path("spine.mha"), "another");
    });
    EXPECT_LT(result.exit_code, 2) << result.err;
    EXPECT_EQ(json::parse(read_text(folder.path("result/report.json"))).at("inputs"), before);
}

TEST_F(Robustness, AStudysJournalOfBracketsIsRefused) {
    const std::vector<std::string> arguments{"study",
                                             "-v",
                                             folder.path("spine.mha"),
                                             "--attenuation",
                                             "--views",
                                             folder.path("xrays/views.json"),
                                             "--truth",
                                             folder.path("truth.json"),
                                             "--bins",
                                             "0:1:1",
                                             "--per-bin",
                                             "1",
                                             "-o",
                                             folder.path("study")};
    const std::string brackets(200000, '[');
    std::filesystem::create_directory(folder.path("study"));
    write_text_file(folder.path("study/study.journal"), brackets + "\n");
    const ProgramResult first = run_raylign(arguments);
    EXPECT_EQ(first.exit_code, 2);
    EXPECT_THAT(first.err, HasSubstr("is not the journal of a study"));
    write_text_file(folder.path("study/study.journal"),
                    R"({"raylign_study":)" + brackets + std::string(200000, ']') + "}\n");
    EXPECT_EQ(run_raylign(arguments).exit_code, 2);
    std::filesystem::remove(folder.path("study/study.journal"));
    ASSERT_EQ(run_raylign(arguments).exit_code, 0);
    std::string journal = read_text(folder.path("study/study.journal"));
    write_text_file(folder.path("study/study.journal"), journal + brackets + "\n");
    const ProgramResult second = run_raylign(arguments);
    EXPECT_EQ(second.exit_code, 2);
    EXPECT_THAT(second.err, AllOf(HasSubstr("study.journal, line 4 is damaged"), HasSubstr("nested")));
    journal.replace(journal.find("\"case\":0"), 8, "\"case\":7");
    write_text_file(folder.path("study/study.journal"), journal);
    const ProgramResult third = run_raylign(arguments);
    EXPECT_EQ(third.exit_code, 2);
    EXPECT_THAT(third.err, HasSubstr("trial 0 is not where the study has it"));
}

}  // namespace
}  // namespace raylign::detail::test
