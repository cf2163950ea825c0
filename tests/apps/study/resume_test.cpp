// `raylign study` goes on where a kill, a full disk or a torn line stopped it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/random.h"
#include "tests/apps/study/study_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

using StudyResume = StudyCase;

/// Starts the study and kills it when its journal has grown by `lines`.
void kill_after(const std::vector<std::string>& arguments, const std::filesystem::path& journal, std::size_t lines) {
    const pid_t child = fork();
    if (child == 0) {
        std::vector<std::string> words{RAYLIGN_PROGRAM};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        execv(argv[0], argv.data());
        _exit(127);
    }
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    int status = 0;
    while (std::chrono::steady_clock::now() < deadline && waitpid(child, &status, WNOHANG) == 0) {
        if (lines_of(read_text(journal)).size() >= lines) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            return;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

TEST_F(StudyResume, KilledThreeTimesItLosesNothingAndCountsNothingTwice) {
    const std::vector<std::string> many{"--bins", "0:5:20", "--per-bin", "10", "--view", "AP", "--quiet"};
    ASSERT_EQ(run("whole", many).exit_code, 0);
    Random random(3);
    std::size_t before = 0;
    for (int i = 0; i < 3; ++i) {
        const auto journal = folder.folder() / "killed" / "study.journal";
        kill_after(arguments("killed", many), journal, before + 3 + static_cast<std::size_t>(random.uniform(0, 9)));
        const std::size_t after = lines_of(read_text(journal)).size();
        EXPECT_GT(after, before) << "kill " << i;
        before = after;
    }
    EXPECT_LT(before, 43U) << "the kills came too late to show anything";
    EXPECT_FALSE(std::filesystem::exists(folder.path("killed/study.csv")));
    ASSERT_EQ(run("killed", many).exit_code, 0);
    EXPECT_EQ(results_of(csv("killed")), results_of(csv("whole")));
    EXPECT_EQ(lines_of(csv("killed")).size(), 41U);
    EXPECT_EQ(json::parse(read_text(folder.path("killed/study.json"))).at("runs").size(), 4U);
}

TEST_F(StudyResume, ATornLastLineIsDroppedAndItsTrialRunAgain) {
    ASSERT_EQ(run("out", kSmall).exit_code, 0);
    const std::string whole = results_of(csv("out")), journal = read_text(folder.path("out/study.journal"));
    for (const std::size_t cut : {std::size_t{1}, std::size_t{40}, journal.size() / 2, journal.size() - 5}) {
        write_text_file(folder.path("out/study.journal"), journal.substr(0, journal.size() - cut));
        ASSERT_EQ(run("out", kSmall).exit_code, 0) << cut;
        EXPECT_EQ(results_of(csv("out")), whole) << cut;
    }
}

TEST_F(StudyResume, ADamagedJournalIsRefusedWithItsLine) {
    ASSERT_EQ(run("out", kSmall).exit_code, 0);
    std::vector<std::string> lines = lines_of(read_text(folder.path("out/study.journal")));
    const auto write = [&](const std::vector<std::string>& all) {
        std::string text;
        for (const std::string& line : all) text += line + "\n";
        write_text_file(folder.path("out/study.journal"), text);
    };
    std::vector<std::string> torn = lines, twice = lines;
    torn[3] = torn[3].substr(0, 50);
    write(torn);
    EXPECT_THAT(run("out", kSmall).err, HasSubstr("study.journal, line 4 is damaged"));
    twice.push_back(lines[5]);
    write(twice);
    const ProgramResult result = run("out", kSmall);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("stands there twice"));
}

TEST_F(StudyResume, AnotherConfigurationInTheSameFolderIsRefusedNamingTheDifference) {
    ASSERT_EQ(run("out", kSmall).exit_code, 0);
    const std::string before = read_text(folder.path("out/study.journal"));
    std::vector<std::string> other = kSmall;
    other[3] = "4";
    const ProgramResult result = run("out", other);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("per_bin is 3 there and 4 here"));
    EXPECT_EQ(read_text(folder.path("out/study.journal")), before);
    write_text_file(folder.path("truth.json"), read_text(folder.path("start.json")));
    EXPECT_THAT(run("out", kSmall).err, HasSubstr("inputs is")) << "another pose in the same file";
}

TEST_F(StudyResume, EveryOptionThatDecidesATrialIsPartOfTheConfiguration) {
    const std::vector<std::string> tiny{"--bins",   "0:10:10", "--per-bin",        "1", "--view", "AP",
                                        "--levels", "1",       "--max-iterations", "1"};
    ASSERT_EQ(run("out", tiny).exit_code, 0);
    const std::string before = read_text(folder.path("out/study.journal"));
    const std::vector<std::pair<std::vector<std::string>, std::string>> others{
        {{"--object", "-60,-60,-60,60,60,60"}, "object is"},
        {{"--bone-threshold", "0.01"}, "bone_threshold is"},
        {{"--clip", "0.05"}, "clip is"},
        {{"--interpolation", "exact"}, "interpolation is"}};
    for (const auto& [flags, difference] : others) {
        std::vector<std::string> other = tiny;
        other.insert(other.end(), flags.begin(), flags.end());
        const ProgramResult result = run("out", other);
        EXPECT_EQ(result.exit_code, 2) << difference;
        EXPECT_THAT(result.err, HasSubstr(difference));
    }
    EXPECT_EQ(read_text(folder.path("out/study.journal")), before);
}

TEST_F(StudyResume, AFileThatIsNoJournalIsLeftAlone) {
    std::filesystem::create_directory(folder.path("out"));
    for (const std::string text : {"my notes", "my notes\n", "{\"a\": 1}\n"}) {
        write_text_file(folder.path("out/study.journal"), text);
        const ProgramResult result = run("out", kSmall);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr("is not the journal of a study"));
        EXPECT_EQ(read_text(folder.path("out/study.journal")), text);
    }
}

TEST_F(StudyResume, AFullDiskEndsItAndTheNextRunGoesOn) {
    std::vector<std::string> many = kSmall;
    const ProgramResult full = run_raylign_on_full_disk(arguments("out", many), 4096);
    EXPECT_EQ(full.exit_code, 2);
    EXPECT_THAT(full.err, HasSubstr("study.journal cannot be written"));
    ASSERT_EQ(run("out", many).exit_code, 0);
    ASSERT_EQ(run("whole", many).exit_code, 0);
    EXPECT_EQ(results_of(csv("out")), results_of(csv("whole")));
}

}  // namespace
}  // namespace raylign::detail::test
