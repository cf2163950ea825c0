// Cohorts: a row a registration or track, resumable, on one process or several.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "apps/batch/jobs.h"
#include "tests/apps/small_case.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

class BatchCommand : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(scene.make_phantom().exit_code, 0);
        ASSERT_EQ(scene.simulate().exit_code, 0);
    }
    /// Rows of `name,volume,start`: the rest is shared.
    void write_jobs(const std::vector<std::array<std::string, 3>>& rows) const {
        std::string text = "name,volume,attenuation,views,start,search\n";
        for (const auto& [name, volume, start] : rows) {
            text += name + "," + volume + ",yes,xrays/views.json," + start + ",none\n";
        }
        write_text_file(folder.path("jobs.csv"), text);
    }
    void write_many(int count) const {
        std::vector<std::array<std::string, 3>> rows;
        for (int i = 0; i < count; ++i) rows.push_back({"case" + std::to_string(i), "spine.mha", "start.json"});
        write_jobs(rows);
    }
    [[nodiscard]] std::vector<std::string> arguments(const std::vector<std::string>& more = {}) const {
        std::vector<std::string> list{"batch", folder.path("jobs.csv"), "-o", folder.path("out")};
        list.insert(list.end(), more.begin(), more.end());
        return list;
    }
    [[nodiscard]] json report() const { return json::parse(read_text(folder.path("out/batch.json"))); }
    [[nodiscard]] std::ptrdiff_t journal_lines() const {
        const std::string text = read_text(folder.path("out/batch.journal"));
        return std::ranges::count(text, '\n');
    }

    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(BatchCommand, AJobThatFailsCostsThatJob) {
    write_jobs({{"good", "spine.mha", "start.json"}, {"lost", "nowhere.mha", "start.json"}, {"far", "spine.mha", ""}});
    const ProgramResult run = run_raylign(arguments());
    EXPECT_EQ(run.exit_code, 1) << run.err;
    const json found = report();
    EXPECT_EQ(found.at("jobs").size(), 3u);
    EXPECT_EQ(found.at("jobs_by_status").at("failed"), 1);
    EXPECT_EQ(found.at("jobs_by_status").at("open"), 0);
    const auto job = [&](const std::string& name) {
        return *std::ranges::find_if(found.at("jobs"), [&](const json& j) { return j.at("name") == name; });
    };
    EXPECT_EQ(job("good").at("status"), "ok");
    EXPECT_LT(job("good").at("cost"), 0.1);
    EXPECT_EQ(job("good").at("page"), "good/report.html");
    EXPECT_EQ(job("lost").at("exit_code"), 2);
    EXPECT_THAT(job("lost").at("reasons").at(0).get<std::string>(), HasSubstr("nowhere.mha"));
    EXPECT_NE(found.at("jobs").at(2).at("status"), "doubtful") << "the doubtful ones stand first";
    EXPECT_THAT(names_in(folder.folder() / "out"),
                AllOf(Contains("good"), Contains("lost.log"), Contains("batch.csv"), Contains("batch.html")));
    EXPECT_THAT(read_text(folder.path("out/batch.html")), HasSubstr("\"kind\":\"batch\""));
    EXPECT_THAT(read_text(folder.path("out/batch.csv")), HasSubstr("lost,register,failed,2,"));
    EXPECT_TRUE(std::filesystem::exists(folder.path("out/good/pose.json")));
}

TEST_F(BatchCommand, WhatHasEndedIsNotDoneAgainAndWhatChangedIs) {
    write_many(2);
    ASSERT_EQ(run_raylign(arguments()).exit_code, 0);
    const auto written = [&](const char* name) { return std::filesystem::last_write_time(folder.path(name)); };
    const auto first = written("out/case0/pose.json"), second = written("out/case1/pose.json");
    EXPECT_EQ(run_raylign(arguments()).exit_code, 0);
    EXPECT_EQ(journal_lines(), 3);
    EXPECT_EQ(written("out/case0/pose.json"), first);
    write_jobs({{"case0", "spine.mha", "start.json"}, {"case1", "spine.mha", "truth.json"}});
    EXPECT_EQ(run_raylign(arguments()).exit_code, 0);
    EXPECT_EQ(journal_lines(), 4);
    EXPECT_EQ(written("out/case0/pose.json"), first);
    EXPECT_NE(written("out/case1/pose.json"), second);
}

TEST_F(BatchCommand, FailedJobsRunAgainOnlyWhenAsked) {
    write_jobs({{"late", "later.mha", "start.json"}});
    EXPECT_EQ(run_raylign(arguments()).exit_code, 1);
    std::filesystem::copy(folder.path("spine.mha"), folder.path("later.mha"));
    EXPECT_EQ(run_raylign(arguments()).exit_code, 1);
    EXPECT_EQ(journal_lines(), 2);
    EXPECT_EQ(run_raylign(arguments({"--retry"})).exit_code, 0);
    EXPECT_EQ(journal_lines(), 3);
}

TEST_F(BatchCommand, KilledThreeTimesNothingIsLostOrDoneTwice) {
    constexpr int kJobs = 12;
    write_many(kJobs);
    for (const int signal : {SIGKILL, SIGTERM, SIGKILL}) {
        const std::ptrdiff_t before = std::filesystem::exists(folder.path("out/batch.journal")) ? journal_lines() : 1;
        const ProgramResult run = run_raylign_and(
            arguments(), [&] { return journal_lines() >= before + 2; },
            [signal](int process) { ::kill(process, signal); });
        EXPECT_EQ(run.exit_code, signal == SIGTERM ? 130 : 128 + signal) << run.err;
        EXPECT_LT(journal_lines(), kJobs + 1) << "it was still at work";
    }
    EXPECT_EQ(run_raylign(arguments()).exit_code, 0);
    EXPECT_EQ(journal_lines(), kJobs + 1) << "its head, and a line a job";
    EXPECT_EQ(report().at("jobs_by_status").at("ok"), kJobs);
}

TEST_F(BatchCommand, FourRanksGiveTheSameBits) {
    if (std::string(RAYLIGN_MPIEXEC).empty()) GTEST_SKIP() << "this build has no MPI";
    write_many(5);
    ASSERT_EQ(run_raylign(arguments()).exit_code, 0);
    const std::string launcher =
        "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 " RAYLIGN_MPIEXEC " --oversubscribe -n 4 ";
    const std::string command = launcher + RAYLIGN_PROGRAM + " batch " + folder.path("jobs.csv") + " --quiet -o " +
                                folder.path("ranks") + " 2>" + folder.path("err.txt");
    ASSERT_EQ(std::system(command.c_str()), 0) << read_text(folder.path("err.txt"));
    for (int i = 0; i < 5; ++i) {
        const std::string pose = "/case" + std::to_string(i) + "/pose.json";
        EXPECT_EQ(read_text(folder.path("ranks" + pose)), read_text(folder.path("out" + pose)));
    }
}

TEST_F(BatchCommand, TablesThatAreNoneAreNamed) {
    const auto message = [&](const std::string& text) {
        write_text_file(folder.path("jobs.csv"), text);
        return error_of([&] { (void)apps::read_jobs(folder.path("jobs.csv")); });
    };
    EXPECT_THAT(message("volume,views\na,b\n"), HasSubstr("\"name\""));
    EXPECT_THAT(message("name,volume\na/b,c\n"), AllOf(HasSubstr("line 2"), HasSubstr("a/b")));
    EXPECT_THAT(message("name,volume\na,b\nA,c\n"), AllOf(HasSubstr("line 3"), HasSubstr("different")));
    EXPECT_THAT(message("name,command\na,study\n"), HasSubstr("register or track"));
    EXPECT_THAT(message("name,volume\na\n"), HasSubstr("2 as in the heading"));
    EXPECT_THAT(message("name,output\na,b\n"), HasSubstr("folder"));
    EXPECT_THAT(message("name,volume\n"), HasSubstr("no jobs"));
}

TEST(BatchJobs, CellsBecomeOptions) {
    const TestFolder folder;
    write_text_file(folder.path("jobs.csv"),
                    "name,command,bone,attenuation,content\nknee,track,femur=f.mha;tibia=t.mha,yes,\n");
    const std::vector<apps::BatchJob> jobs = apps::read_jobs(folder.path("jobs.csv"));
    ASSERT_EQ(jobs.size(), 1u);
    EXPECT_EQ(jobs[0].command, "track");
    EXPECT_THAT(jobs[0].arguments, ElementsAre("--bone", "femur=f.mha", "--bone", "tibia=t.mha", "--attenuation"));
}

}  // namespace
}  // namespace raylign::detail::test
