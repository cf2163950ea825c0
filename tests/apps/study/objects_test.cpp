// `study --move`: several objects, each moved by its own motion and registered together.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "raylign/io/volume.h"
#include "raylign/phantom.h"
#include "tests/apps/study/study_case.h"

namespace raylign::detail {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

class StudyOfObjects : public test::StudyCase {
protected:
    void SetUp() override {
        StudyCase::SetUp();
        const VoxelGrid grid = centred_grid({32, 32, 32}, {7, 7, 7});
        Volume map{grid, std::vector<float>(32UL * 32 * 32, 0)};
        for (int label = 1; label <= 2; ++label) {
            const Volume bone = voxelise(spine_vertebra(Eigen::Vector3d::Constant(224), label + 1), grid, 2);
            for (std::size_t i = 0; i < map.attenuation_per_mm.size(); ++i) {
                if (bone.attenuation_per_mm[i] > 0) map.attenuation_per_mm[i] = static_cast<float>(label);
            }
        }
        write_volume(folder.path("labels.mha"), map);
    }
    [[nodiscard]] std::vector<std::string> moving(const std::vector<std::string>& more = {}) const {
        std::vector<std::string> all{"--labels",  folder.path("labels.mha"),
                                     "--move",    "1",
                                     "--move",    "2",
                                     "--by",      "4,4",
                                     "--bins",    "3:3:6",
                                     "--per-bin", "1"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    [[nodiscard]] std::string refusal(const std::vector<std::string>& more) const {
        const test::ProgramResult result = run("refused", more);
        EXPECT_EQ(result.exit_code, 2) << result.out;
        return result.err;
    }
};

TEST_F(StudyOfObjects, TellsEachOfThemApart) {
    ASSERT_EQ(run("study", moving({"--rest", "still"})).exit_code, 0);
    const std::vector<std::string> rows = test::lines_of(csv("study"));
    ASSERT_EQ(rows.size(), 3U);
    EXPECT_THAT(rows[0], HasSubstr("metric,object,low_mm"));
    EXPECT_THAT(rows[1], HasSubstr(",label_1,"));
    EXPECT_THAT(rows[2], HasSubstr(",label_2,"));
    const Json report = Json::parse(test::read_text(folder.path("study/study.json")));
    EXPECT_EQ(report["settings"]["rest"], "still");
    ASSERT_EQ(report["cases"].size(), 2U);
    for (int k = 0; k < 2; ++k) {
        EXPECT_EQ(report["cases"][k]["object"], "label_" + std::to_string(k + 1));
        EXPECT_EQ(report["cases"][k]["overall"]["trials"], 1);
        EXPECT_EQ(report["cases"][k]["errors"], 0);
    }
    const Json starts = Json::parse(test::read_text(folder.path("study/study_starts.json")))["starts"];
    ASSERT_EQ(starts.size(), 2U);
    for (const Json& start : starts) {
        EXPECT_GE(start["initial_mtre_mm"], 3);
        EXPECT_LE(start["initial_mtre_mm"], 6);
    }
    EXPECT_EQ(starts[0]["seed"], starts[1]["seed"]);
    EXPECT_NE(starts[0]["true_world_from_ct"], starts[1]["true_world_from_ct"]);  // each by its own motion
    EXPECT_THAT(test::read_text(folder.path("study/study.html")), HasSubstr("label_2: AP+LAT"));
}

TEST_F(StudyOfObjects, OneObjectsTrialRunAloneIsThatOfTheStudy) {
    ASSERT_EQ(run("study", moving()).exit_code, 0);
    const test::ProgramResult alone = test::run_raylign(arguments("alone", moving({"--trial", "1"})));
    ASSERT_EQ(alone.exit_code, 0) << alone.err;
    const Json record = Json::parse(alone.out);
    EXPECT_EQ(record["trial"], 1);
    const std::vector<std::string> journal = test::lines_of(test::read_text(folder.path("study/study.journal")));
    EXPECT_EQ(record["world_from_ct"], Json::parse(journal.back())["world_from_ct"]);
}

TEST_F(StudyOfObjects, AMotionThatIsNoneIsRefused) {
    EXPECT_THAT(refusal({"--move", "1"}), HasSubstr("give --labels FILE"));
    EXPECT_THAT(refusal({"--rest", "still"}), HasSubstr("--rest has no meaning without --move"));
    EXPECT_THAT(refusal(moving({"--rest", "sideways"})), HasSubstr("body, still or none"));
    EXPECT_THAT(refusal(moving({"--method", "steepest-descent"})), HasSubstr("auto or gauss-newton"));
    EXPECT_THAT(refusal({"--labels", folder.path("labels.mha"), "--move", "1=pose.json"}), HasSubstr("at random"));
}

}  // namespace
}  // namespace raylign::detail
