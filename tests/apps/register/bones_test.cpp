// `register` with several objects: what it leaves, and what it refuses.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "raylign/io/volume.h"
#include "raylign/phantom.h"
#include "tests/apps/run_program.h"
#include "tests/apps/small_case.h"

namespace raylign::detail {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using Json = nlohmann::json;

/// The small spine with a label map of its third and fourth vertebra: 1 and 2.
class BonesProgram : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(small.make_phantom().exit_code, 0);
        ASSERT_EQ(small.simulate().exit_code, 0);
        const VoxelGrid grid = centred_grid({64, 64, 64}, {3.5, 3.5, 3.5});
        Volume map{grid, std::vector<float>(64 * 64 * 64, 0)};
        for (int label = 1; label <= 2; ++label) {
            const Volume bone = voxelise(spine_vertebra(Eigen::Vector3d::Constant(224), label + 1), grid, 2);
            for (std::size_t i = 0; i < map.attenuation_per_mm.size(); ++i) {
                if (bone.attenuation_per_mm[i] > 0) map.attenuation_per_mm[i] = static_cast<float>(label);
            }
        }
        write_volume(folder.path("labels.mha"), map);
    }
    [[nodiscard]] test::ProgramResult run(const std::vector<std::string>& more) const {
        return test::run_raylign(small.register_arguments(more));
    }
    [[nodiscard]] test::ProgramResult simulate(const std::string& into, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"drr",
                                           "-v",
                                           folder.path("spine.mha"),
                                           "--attenuation",
                                           "--labels",
                                           folder.path("labels.mha"),
                                           "--views",
                                           folder.path("geometry.json"),
                                           "--pose",
                                           folder.path("start.json"),
                                           "-o",
                                           folder.path(into)};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return test::run_raylign(arguments);
    }
    [[nodiscard]] std::string refusal(std::vector<std::string> more) const {
        more.insert(more.begin(), {"--labels", folder.path("labels.mha")});
        const test::ProgramResult result = run(more);
        EXPECT_EQ(result.exit_code, 2) << result.out;
        return result.err;
    }

    test::TestFolder folder;
    test::SmallCase small{folder};
};

TEST_F(BonesProgram, LeavesAPoseAVerdictAndAnErrorForEach) {
    const test::ProgramResult result =
        run({"--labels", folder.path("labels.mha"), "--bone", "low=1", "--object", "2", "--rest", "body", "--truth",
             folder.path("truth.json"), "--joint", "low,label_2", "--backend", "cpu"});
    ASSERT_LE(result.exit_code, 1) << result.err;
    EXPECT_THAT(test::names_in(folder.path("result")),
                testing::UnorderedElementsAre("drr_AP.tif", "drr_LAT.tif", "overlay_AP.png", "overlay_LAT.png",
                                              "pose_label_2.json", "pose_label_2.tfm", "pose_low.json", "pose_low.tfm",
                                              "pose_rest.json", "pose_rest.tfm", "report.html", "report.json"));
    const Json report = Json::parse(test::read_text(folder.path("result/report.json")));
    ASSERT_EQ(report["objects"].size(), 3U);
    EXPECT_EQ(report["objects"][0]["name"], "label_2");  // of --object, then of --bone
    EXPECT_EQ(report["objects"][1]["name"], "low");
    EXPECT_EQ(report["objects"][2]["name"], "rest");
    for (int k = 0; k < 2; ++k) {  // voxels of 3.5 mm; started 5.6 mm off
        EXPECT_LT(report["objects"][k]["tre"]["final_mtre_mm"], 1.2) << report["objects"][k]["verdict"];
        EXPECT_GT(report["objects"][k]["tre"]["initial_mtre_mm"], 4);
    }
    EXPECT_EQ(report["verdict"]["ok"].get<bool>(), result.exit_code == 0);
    ASSERT_EQ(report["joints"].size(), 1U);
    EXPECT_LT(std::abs(report["joints"][0]["angles_deg"][0].get<double>()), 3);  // they moved as one
    const Json pose = Json::parse(test::read_text(folder.path("result/pose_low.json")));
    EXPECT_EQ(pose["world_from_ct"], report["objects"][1]["world_from_ct"]);
    EXPECT_THAT(result.out, AllOf(HasSubstr("low"), HasSubstr("label_2"), HasSubstr("joint")));
}

TEST_F(BonesProgram, AJointsLimitAndCollisionsAreReported) {
    const test::ProgramResult result =
        run({"--labels", folder.path("labels.mha"), "--object", "1", "--object", "2", "--joint", "label_1,label_2=5,5",
             "--rest", "body", "--backend", "cpu", "--json"});
    ASSERT_LE(result.exit_code, 1) << result.err;
    const Json report = Json::parse(result.out);
    const Json& joint = report["joints"].at(0);
    EXPECT_EQ(joint["limit"]["apart_mm"], 5);
    EXPECT_EQ(joint["limit"]["turned_deg"], 5);
    EXPECT_LT(joint["since_ct"]["apart_mm"], 2);  // they moved as one
    EXPECT_EQ(joint["limit"]["used"].get<bool>(), true) << report["verdict"];
    EXPECT_TRUE(report["collisions"].is_array());
    EXPECT_THAT(test::read_text(folder.path("result/report.html")), HasSubstr("\"objects\":[{\"label\":\"label_1\""));
}

TEST_F(BonesProgram, SplitsACtWithoutAMapIntoBones) {
    const test::ProgramResult result = run({"--segment-bones", "--object", "all-bones", "--rest", "still", "--backend",
                                            "cpu", "--json", "--search", "none"});
    ASSERT_LE(result.exit_code, 1) << result.err;
    const Json report = Json::parse(result.out);
    EXPECT_THAT(report["objects"][0]["name"].get<std::string>(), testing::StartsWith("middle_"));
    EXPECT_THAT(test::read_text(folder.path("result/bones.csv")), HasSubstr("1,middle_1\n"));
    EXPECT_THAT(test::names_in(folder.path("result")), Contains("bones.nii.gz"));
}

TEST_F(BonesProgram, AnObjectThatDrrMovedIsFoundWhereItIs) {
    const std::vector<std::string> moved{"--move", "1", "--by", "4,4", "--seed", "5"};
    ASSERT_EQ(simulate("moved", moved).exit_code, 0);
    ASSERT_EQ(simulate("again", moved).exit_code, 0);
    const std::string pose = test::read_text(folder.path("moved/pose_label_1.json"));
    EXPECT_EQ(pose, test::read_text(folder.path("again/pose_label_1.json")));
    const test::ProgramResult result = test::run_raylign({"register",
                                                          "-v",
                                                          folder.path("spine.mha"),
                                                          "--attenuation",
                                                          "--labels",
                                                          folder.path("labels.mha"),
                                                          "--object",
                                                          "1",
                                                          "--rest",
                                                          "still",
                                                          "--views",
                                                          folder.path("moved/views.json"),
                                                          "--start",
                                                          folder.path("start.json"),
                                                          "--truth",
                                                          folder.path("moved/pose_label_1.json"),
                                                          "-o",
                                                          folder.path("result"),
                                                          "--backend",
                                                          "cpu"});
    ASSERT_LE(result.exit_code, 1) << result.err;
    const Json found = Json::parse(test::read_text(folder.path("result/report.json")))["objects"][0];
    EXPECT_GT(found["tre"]["initial_mtre_mm"], 2);
    EXPECT_LT(found["tre"]["final_mtre_mm"], 0.7) << found["verdict"];  // voxels of 3.5 mm
    EXPECT_EQ(simulate("bad", {"--by", "4,4"}).exit_code, 2);
    EXPECT_EQ(simulate("bad", {"--move", "1", "--by", "4"}).exit_code, 2);
}

TEST_F(BonesProgram, AModelsXrayShowsWhatHasMoved) {
    const auto counted = [&](const std::string& into, const std::string& by) {
        const test::ProgramResult result =
            simulate(into, {"--move", "1", "--by", by, "--seed", "5", "--xray", "c-arm", "--noise", "0"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return test::read_text(folder.path(into + "/drr_AP.tif"));
    };
    const std::string still = counted("still", "0,0");
    EXPECT_EQ(still, counted("again", "0,0"));
    EXPECT_NE(still, counted("moved", "6,6"));
}

TEST_F(BonesProgram, RestThatStaysIsNotJudged) {
    const test::ProgramResult result = run({"--labels", folder.path("labels.mha"), "--object", "1", "--rest", "still",
                                            "--search", "none", "--backend", "cpu"});
    ASSERT_LE(result.exit_code, 1) << result.err;
    const Json report = Json::parse(test::read_text(folder.path("result/report.json")));
    const Json& rest = report["objects"][1];
    EXPECT_FALSE(rest["moves"]);
    EXPECT_EQ(rest["world_from_ct"], rest["start_world_from_ct"]);
    EXPECT_TRUE(rest["covariance"].is_null());
}

TEST_F(BonesProgram, BadObjectsAreRefused) {
    EXPECT_THAT(refusal({"--object", "7"}), HasSubstr("7"));
    EXPECT_THAT(refusal({"--object", "vertebra_L9"}), HasSubstr("did you mean vertebrae_L"));
    EXPECT_THAT(refusal({"--object", "1", "--bone", "a=1"}), HasSubstr("is of two objects"));
    EXPECT_THAT(refusal({"--object", "1", "--rest", "sideways"}), HasSubstr("body, still or none"));
    EXPECT_THAT(refusal({"--object", "1", "--label", "2"}), HasSubstr("--label contradicts"));
    EXPECT_THAT(refusal({"--object", "all-bones", "--object", "1"}), HasSubstr("contradicts other objects"));
    EXPECT_THAT(refusal({"--object", "1", "--start", "hip=x.json"}), HasSubstr("object of --start = hip"));
    EXPECT_THAT(refusal({"--object", "1", "--joint", "label_1,hip"}), HasSubstr("object of --joint = hip"));
    EXPECT_THAT(refusal({"--object", "1", "--refine-views"}), HasSubstr("--refine-views is for one object"));
    EXPECT_THAT(refusal({"--object", "1", "--method", "bobyqa"}), HasSubstr("auto or gauss-newton"));
    EXPECT_THAT(refusal({"--bone", "rest=1"}), HasSubstr("not \"rest\""));
    EXPECT_THAT(refusal({"--rest", "body"}), HasSubstr("--rest is for several objects"));
    EXPECT_THAT(run({"--object", "1"}).err, HasSubstr("--labels FILE"));
}

TEST_F(BonesProgram, FilesOfOneBoneAreRefused) {
    const std::vector<std::string> views{"--views", folder.path("xrays/views.json"), "--attenuation", "-o",
                                         folder.path("result")};
    const auto refusal_of = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "register");
        arguments.insert(arguments.end(), views.begin(), views.end());
        const test::ProgramResult result = test::run_raylign(arguments);
        EXPECT_EQ(result.exit_code, 2) << result.out;
        return result.err;
    };
    const std::string spine = folder.path("spine.mha");
    EXPECT_THAT(refusal_of({"--bone", "a=" + spine, "--bone", "b=" + spine}), HasSubstr("b hold the same bone"));
    write_volume(folder.path("more_air.mha"),
                 voxelise(spine_phantom(Eigen::Vector3d::Constant(100)), centred_grid({60, 60, 60}, {2, 2, 2}), 1));
    write_volume(folder.path("less_air.mha"),
                 voxelise(spine_phantom(Eigen::Vector3d::Constant(100)), centred_grid({54, 54, 54}, {2, 2, 2}), 1));
    EXPECT_THAT(
        refusal_of({"--bone", "a=" + folder.path("more_air.mha"), "--bone", "b=" + folder.path("less_air.mha")}),
        HasSubstr("hold the same bone"));
    EXPECT_THAT(refusal_of({"--bone", "a=" + spine, "--bone", "A=" + spine}), HasSubstr("names A twice"));
    EXPECT_THAT(refusal_of({"--bone", "a=" + spine, "--rest", "body"}), HasSubstr("files of bones have no rest"));
    EXPECT_THAT(refusal_of({}), HasSubstr("no CT: give -v FILE, or --bone NAME=FILE"));
}

}  // namespace
}  // namespace raylign::detail
