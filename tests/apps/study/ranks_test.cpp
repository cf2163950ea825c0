// The same study on several processes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <sstream>

#include "tests/apps/study/study_case.h"

namespace raylign::detail::test {
namespace {

class StudyRanks : public testing::Test {
protected:
    void SetUp() override {
        if (std::string(RAYLIGN_MPIEXEC).empty()) GTEST_SKIP() << "this build has no MPI";
        ASSERT_EQ(run_raylign({"phantom", "spine", "--size", "32", "--spacing", "7", "-o", folder.path("spine.mha")})
                      .exit_code,
                  0);
    }
    [[nodiscard]] std::string command(const std::string& output, const std::string& more = {}) const {
        return std::string(RAYLIGN_PROGRAM) + " study -v " + folder.path("spine.mha") + " --attenuation --views " +
               folder.path("geometry.json") + " --truth " + folder.path("truth.json") +
               " --backend cpu --threads 1 --noise 20000 --bins 0:10:20 --per-bin 6 --view AP --view AP,LAT --quiet "
               "-o " +
               folder.path(output) + " " + more + " >" + folder.path("out.txt") + " 2>" + folder.path("err.txt");
    }
    [[nodiscard]] int on_ranks(int count, const std::string& command_line) const {
        const std::string launcher = "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 " RAYLIGN_MPIEXEC
                                     " --oversubscribe -n " +
                                     std::to_string(count) + " ";
        return std::system((launcher + command_line).c_str());
    }
    [[nodiscard]] std::string csv(const std::string& output) const {
        return results_of(read_text(folder.path(output + "/study.csv")));
    }

    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(StudyRanks, GiveTheSerialResultBitForBit) {
    ASSERT_EQ(std::system(command("serial").c_str()), 0);
    for (const int ranks : {1, 2, 4}) {
        const std::string output = "ranks" + std::to_string(ranks);
        ASSERT_EQ(on_ranks(ranks, command(output)), 0) << read_text(folder.path("err.txt"));
        EXPECT_EQ(csv(output), csv("serial")) << ranks;
    }
}

TEST_F(StudyRanks, ARankThatDiesCostsItsUnfinishedTrialsOnly) {
    ASSERT_EQ(std::system(command("serial").c_str()), 0);
    // Rank 1 is killed by itself in the middle: the launcher then ends the rest.
    const std::string dying =
        "sh -c 'if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then (while [ $(cat " + folder.path("died/study.journal") +
        " 2>/dev/null | wc -l) -lt 6 ]; do sleep 0.005; done; kill -9 $$) & fi; exec " + command("died") + "'";
    EXPECT_NE(on_ranks(3, dying), 0);
    EXPECT_FALSE(std::filesystem::exists(folder.path("died/study.csv")));
    std::istringstream journal(read_text(folder.path("died/study.journal")));
    int lines = 0;
    for (std::string line; std::getline(journal, line);) ++lines;
    EXPECT_GE(lines, 6) << "what was finished stays";
    ASSERT_EQ(on_ranks(2, command("died")), 0);
    EXPECT_EQ(csv("died"), csv("serial"));
}

TEST_F(StudyRanks, ADeviceThatIsNotThereEndsWithThree) {
    std::string line = command("none", "--device 99");
    line.replace(line.find("--backend cpu --threads 1"), 25, "--backend gl");
    const auto exit_code = [](int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -1; };
    EXPECT_EQ(exit_code(std::system(line.c_str())), 3) << read_text(folder.path("err.txt"));
    EXPECT_EQ(exit_code(on_ranks(2, line)), 3) << read_text(folder.path("err.txt"));
}

TEST_F(StudyRanks, BadInputIsToldOnce) {
    std::filesystem::remove(folder.path("truth.json"));
    EXPECT_NE(on_ranks(3, command("bad")), 0);
    const std::string said = read_text(folder.path("err.txt"));
    const std::size_t first = said.find("truth.json");
    ASSERT_NE(first, std::string::npos) << said;
    EXPECT_EQ(said.find("raylign study:", first), std::string::npos) << said;
}

}  // namespace
}  // namespace raylign::detail::test
