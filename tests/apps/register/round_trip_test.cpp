#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr double kVoxelSideMm = 3.5;  // of SmallCase

class RoundTrip : public testing::Test {
protected:
    void SetUp() override {
        const ProgramResult phantom = scene.make_phantom();
        ASSERT_EQ(phantom.exit_code, 0) << phantom.err;
        const ProgramResult drr = scene.simulate();
        ASSERT_EQ(drr.exit_code, 0) << drr.err;
    }

    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(RoundTrip, DrrLeavesImagesAndViewsThatReferToThem) {
    EXPECT_THAT(names_in(folder.folder() / "xrays"), ElementsAre("drr_AP.tif", "drr_LAT.tif", "views.json"));
    const RawXray image = read_xray(folder.path("xrays/drr_AP.tif"));
    EXPECT_FALSE(image.integer_pixels);
    EXPECT_EQ(image.image.width, 64);
    const json views = json::parse(read_text(folder.path("xrays/views.json")));
    EXPECT_EQ(views.at("views").at(1).at("image"), "drr_LAT.tif");
}

TEST_F(RoundTrip, DrrNoiseDependsOnTheSeedOnly) {
    const std::vector<std::string> common{"drr",
                                          "-v",
                                          folder.path("spine.mha"),
                                          "--attenuation",
                                          "--views",
                                          folder.path("geometry.json"),
                                          "--pose",
                                          folder.path("truth.json"),
                                          "--noise",
                                          "1000"};
    for (const auto& [seed, output] : {std::pair{"5", "a"}, {"5", "b"}, {"6", "c"}}) {
        std::vector<std::string> arguments = common;
        arguments.insert(arguments.end(), {"--seed", seed, "-o", folder.path(output)});
        ASSERT_EQ(run_raylign(arguments).exit_code, 0);
    }
    EXPECT_EQ(read_text(folder.path("a/drr_AP.tif")), read_text(folder.path("b/drr_AP.tif")));
    EXPECT_NE(read_text(folder.path("a/drr_AP.tif")), read_text(folder.path("c/drr_AP.tif")));
}

TEST_F(RoundTrip, RegisterRecoversThePoseBelowHalfAVoxel) {
    const ProgramResult result = run_raylign(scene.register_arguments({"--truth", folder.path("truth.json")}));
    ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
    const json report = json::parse(read_text(folder.path("result/report.json")));
    EXPECT_GT(report.at("tre").at("initial_mtre_mm"), kVoxelSideMm);
    EXPECT_LT(report.at("tre").at("final_mtre_mm"), kVoxelSideMm / 2);
    EXPECT_THAT(result.out, HasSubstr("mTRE"));
}

TEST_F(RoundTrip, RegisterLeavesTheFilesOfTheContract) {
    ASSERT_LE(run_raylign(scene.register_arguments()).exit_code, 1);
    EXPECT_THAT(names_in(folder.folder() / "result"),
                ElementsAre("drr_AP.tif", "drr_LAT.tif", "overlay_AP.png", "overlay_LAT.png", "pose.json", "pose.tfm",
                            "report.html", "report.json"));
    const RigidTransform from_json = read_pose(folder.path("result/pose.json"));
    const RigidTransform from_tfm = read_pose(folder.path("result/pose.tfm"));
    EXPECT_LT((to_matrix(from_json) - to_matrix(from_tfm)).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(read_xray(folder.path("result/drr_LAT.tif")).image.height, 64);
    EXPECT_THAT(read_text(folder.path("result/overlay_AP.png")), testing::StartsWith("\x89PNG"));
}

TEST_F(RoundTrip, ReportHasEveryKeyOfTheContract) {
    ASSERT_LE(run_raylign(scene.register_arguments({"--seed", "42"})).exit_code, 1);
    const json report = json::parse(read_text(folder.path("result/report.json")));
    for (const char* key :
         {"raylign",   "command", "seed",          "inputs",      "backend",        "method",        "metric",
          "projector", "cost",    "iterations",    "evaluations", "linearizations", "bytes_to_host", "time_s",
          "levels",    "history", "world_from_ct", "verdict",     "notes",          "memory"}) {
        EXPECT_TRUE(report.contains(key)) << key;
    }
    for (const char* key : {"total", "load", "prepare", "drr", "gradient", "reduction", "transfer", "optimizer"}) {
        EXPECT_GE(report.at("time_s").at(key), 0) << key;
    }
    for (const char* key : {"name", "device", "threads", "instruction_set", "storage", "passed_over"}) {
        EXPECT_TRUE(report.at("backend").contains(key)) << key;
    }
    EXPECT_EQ(report.at("seed"), 42);
    EXPECT_FALSE(report.contains("tre"));
    EXPECT_GT(report.at("evaluations"), 0);
    EXPECT_LT(report.at("cost").at("final"), report.at("cost").at("initial"));
}

TEST_F(RoundTrip, ReportNamesEveryInputWithItsHash) {
    ASSERT_LE(run_raylign(scene.register_arguments()).exit_code, 1);
    const json report = json::parse(read_text(folder.path("result/report.json")));
    std::vector<std::string> paths;
    for (const json& input : report.at("inputs")) {
        paths.push_back(std::filesystem::path(input.at("path")).filename());
        EXPECT_EQ(input.at("sha256").get<std::string>().size(), 64U);
    }
    EXPECT_THAT(paths,
                testing::UnorderedElementsAre("spine.mha", "views.json", "drr_AP.tif", "drr_LAT.tif", "start.json"));
}

TEST_F(RoundTrip, TheCommandInTheReportRepeatsTheRun) {
    ASSERT_LE(run_raylign(scene.register_arguments()).exit_code, 1);
    const std::string pose = read_text(folder.path("result/pose.json"));
    const json report = json::parse(read_text(folder.path("result/report.json")));
    std::filesystem::remove(folder.path("result/pose.json"));
    const std::string command = report.at("command").get<std::string>() + " --quiet";
    ASSERT_NE(std::system(command.c_str()), -1);
    EXPECT_EQ(read_text(folder.path("result/pose.json")), pose);
}

TEST_F(RoundTrip, JsonPrintsTheReportAndNothingElse) {
    const ProgramResult result = run_raylign(scene.register_arguments({"--json"}));
    ASSERT_LE(result.exit_code, 1);
    EXPECT_EQ(result.out, read_text(folder.path("result/report.json")));
    EXPECT_TRUE(json::accept(result.out));
    EXPECT_EQ(result.err, "");
}

TEST_F(RoundTrip, PipedOutputHasNoControlCodes) {
    const ProgramResult result = run_raylign(scene.register_arguments());
    ASSERT_LE(result.exit_code, 1);
    EXPECT_THAT(result.out, HasSubstr("pose.json"));
    EXPECT_THAT(result.out, Not(testing::AnyOf(HasSubstr("\033"), HasSubstr("\r"))));
    EXPECT_EQ(result.err, "");
}

TEST_F(RoundTrip, QuietPrintsNothing) {
    const ProgramResult result = run_raylign(scene.register_arguments({"--quiet"}));
    ASSERT_LE(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(result.err, "");
}

TEST_F(RoundTrip, TheReportNamesTheBackendThatWasAskedFor) {
    ASSERT_LE(run_raylign(scene.register_arguments({"--backend", "reference", "--max-iterations", "1"})).exit_code, 1);
    EXPECT_EQ(json::parse(read_text(folder.path("result/report.json"))).at("backend").at("name"), "reference");
}

TEST_F(RoundTrip, WithoutAStartTheCentralRaysGiveOne) {
    std::vector<std::string> arguments = scene.register_arguments({"--truth", folder.path("truth.json")});
    const auto start = std::ranges::find(arguments, "--start");
    arguments.erase(start, start + 2);
    const ProgramResult result = run_raylign(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
    EXPECT_THAT(result.out, HasSubstr("no --start"));
    const json report = json::parse(read_text(folder.path("result/report.json")));
    EXPECT_LT(report.at("tre").at("final_mtre_mm"), kVoxelSideMm / 2);
}

TEST_F(RoundTrip, ADetectorsCountsAreWrittenAndRegistered) {
    const std::vector<std::string> common{"drr",
                                          "-v",
                                          folder.path("spine.mha"),
                                          "--attenuation",
                                          "--views",
                                          folder.path("geometry.json"),
                                          "--pose",
                                          folder.path("truth.json"),
                                          "--xray",
                                          "flat-panel"};
    for (const auto& [seed, output] : {std::pair{"5", "a"}, {"5", "b"}, {"6", "c"}}) {
        std::vector<std::string> arguments = common;
        arguments.insert(arguments.end(), {"--seed", seed, "--png", "-o", folder.path(output)});
        const ProgramResult drr = run_raylign(arguments);
        ASSERT_EQ(drr.exit_code, 0) << drr.err;
    }
    EXPECT_EQ(read_text(folder.path("a/drr_AP.tif")), read_text(folder.path("b/drr_AP.tif")));
    EXPECT_NE(read_text(folder.path("a/drr_AP.tif")), read_text(folder.path("c/drr_AP.tif")));
    const RawXray counts = read_xray(folder.path("a/drr_AP.tif"));
    EXPECT_TRUE(counts.integer_pixels);
    EXPECT_GT(*std::ranges::max_element(counts.image.pixels), 8000) << "14 bits, open beam at 1 / 1.25";
    const json view = json::parse(read_text(folder.path("a/views.json"))).at("views").at(0);
    EXPECT_EQ(view.at("intensity"), json::parse(R"({"kind": "transmission", "polarity": "bone-dark"})"));
    EXPECT_EQ(view.at("mask"), "auto");

    std::vector<std::string> arguments = scene.register_arguments({"--truth", folder.path("truth.json")});
    *std::ranges::find(arguments, folder.path("xrays/views.json")) = folder.path("a/views.json");
    ASSERT_LE(run_raylign(arguments).exit_code, 1);
    const json report = json::parse(read_text(folder.path("result/report.json")));
    EXPECT_LT(report.at("tre").at("final_mtre_mm"), kVoxelSideMm / 2);
}

TEST_F(RoundTrip, DrrTakesASpectrumOfItsOwn) {
    std::vector<std::string> arguments{"drr",
                                       "-v",
                                       folder.path("spine.mha"),
                                       "--attenuation",
                                       "--views",
                                       folder.path("geometry.json"),
                                       "--pose",
                                       folder.path("truth.json"),
                                       "--noise",
                                       "0",
                                       "--xray",
                                       "flat-panel",
                                       "-o",
                                       folder.path("own")};
    ASSERT_EQ(run_raylign(arguments).exit_code, 0);
    write_text_file(folder.path("soft.csv"), "keV,photons\n8,0\n30,2000\n40,6000\n");
    arguments.back() = folder.path("soft");
    arguments.insert(arguments.end(), {"--spectrum", folder.path("soft.csv")});
    const ProgramResult soft = run_raylign(arguments);
    ASSERT_EQ(soft.exit_code, 0) << soft.err;
    const Image own = read_xray(folder.path("own/drr_AP.tif")).image;
    const Image darker = read_xray(folder.path("soft/drr_AP.tif")).image;
    EXPECT_LT(darker(32, 32), 0.9 * own(32, 32)) << "softer photons pass less";
    EXPECT_NEAR(darker(60, 32), own(60, 32), 0.05 * own(60, 32)) << "beside the spine little changes";
    for (const auto& [table, words] : {std::pair{"keV,photons\n30,-1\n", "photons = -1"},
                                       {"30,1\n200,1\n", "energy = 200"},
                                       {"keV,photons\n", "spectrum = no energies"},
                                       {"30,1,1\n", "energy in keV, photons"}}) {
        write_text_file(folder.path("soft.csv"), table);
        const ProgramResult refused = run_raylign(arguments);
        EXPECT_EQ(refused.exit_code, 2) << table;
        EXPECT_THAT(refused.err, HasSubstr(words));
        EXPECT_THAT(refused.err, HasSubstr("soft.csv"));
    }
}

TEST_F(RoundTrip, DrrRefusesUnknownXrayModelsAndStepsOfItsOwn) {
    std::vector<std::string> arguments{"drr",
                                       "-v",
                                       folder.path("spine.mha"),
                                       "--attenuation",
                                       "--views",
                                       folder.path("geometry.json"),
                                       "--pose",
                                       folder.path("truth.json"),
                                       "-o",
                                       folder.path("x"),
                                       "--xray",
                                       "C-arm"};
    ProgramResult result = run_raylign(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("X-ray model = C-arm: must be one of ideal, c-arm, biplane-lab, flat-panel"));
    arguments.back() = "c-arm";
    arguments.insert(arguments.end(), {"--projector", "trilinear", "--step", "1"});
    result = run_raylign(arguments);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("--step has no meaning with --xray c-arm"));
    EXPECT_FALSE(std::filesystem::exists(folder.path("x")));
}

TEST_F(RoundTrip, DrrPreviewIsAPng) {
    ASSERT_EQ(
        run_raylign({"drr", "-v", folder.path("spine.mha"), "--attenuation", "--views", folder.path("geometry.json"),
                     "--pose", folder.path("truth.json"), "--png", "-o", folder.path("previews")})
            .exit_code,
        0);
    EXPECT_THAT(read_text(folder.path("previews/drr_LAT.png")), testing::StartsWith("\x89PNG"));
}

}  // namespace
}  // namespace raylign::detail::test
