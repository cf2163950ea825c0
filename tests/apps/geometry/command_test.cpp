#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/geometry/summary.h"
#include "tests/apps/run_program.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kMayaCam =
    "image size\n120,100\n\ncamera matrix\n2000,0,61\n0,2100,48\n0,0,1\n\nrotation\n0,0,1\n-1,0,0\n0,-1,0\n\n"
    "translation\n5\n-7\n900\n";
constexpr const char* kCArm = R"({ "raylign": 1, "views": [
  { "name": "AP", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 20, "secondary_angle_deg": -10,
                             "pixel_pitch_mm": [1.5, 1.5], "size_px": [200, 100] } },
  { "name": "LAT", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 90, "secondary_angle_deg": 0,
                              "pixel_pitch_mm": [1.5, 1.5], "size_px": [200, 100] } } ] })";

class GeometryCommand : public testing::Test {
protected:
    void SetUp() override {
        write_text_file(folder.path("cam.txt"), kMayaCam);
        write_text_file(folder.path("views.json"), kCArm);
    }
    TestFolder folder;
};

TEST_F(GeometryCommand, ExplainsAFile) {
    const ProgramResult result = run_raylign({"geometry", folder.path("cam.txt")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("cam  (MayaCam 2"), HasSubstr("120 x 100 px"), HasSubstr("fx 2000.0000"),
                                  HasSubstr("distance unknown"), HasSubstr("assumed")));
    // Source: -R^T t = (-7, 900, -5).
    EXPECT_THAT(result.out, HasSubstr("source      (-7.000, 900.000, -5.000) mm in world"));
}

TEST_F(GeometryCommand, ZeroHasNoSign) {
    const ProgramResult result = run_raylign({"geometry", folder.path("views.json")});
    EXPECT_THAT(result.out,
                AllOf(HasSubstr("primary +90.000, secondary +0.000, in-plane +0.000"), HasSubstr("0.000, ")));
    EXPECT_THAT(result.out, testing::Not(testing::ContainsRegex("-0[.]000")));
    write_text_file(folder.path("axis.txt"),
                    "image size\n100,100\n\ncamera matrix\n2000,0,50\n0,2000,50\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n"
                    "0,0,1\n\ntranslation\n0.0001\n0\n900\n");
    EXPECT_THAT(run_raylign({"geometry", folder.path("axis.txt")}).out,
                HasSubstr("source      (0.000, 0.000, -900.000)"));
}

TEST_F(GeometryCommand, JsonHasTheNumbers) {
    const ProgramResult result = run_raylign({"geometry", folder.path("views.json"), "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json view = json::parse(result.out).at("views").at(0);
    EXPECT_NEAR(view.at("angles_deg").at("primary"), 20, 1e-9);
    EXPECT_NEAR(view.at("angles_deg").at("secondary"), -10, 1e-9);
    EXPECT_NEAR(view.at("angles_deg").at("in_plane"), 0, 1e-9);
    EXPECT_NEAR(view.at("sad_mm"), 1000, 1e-9);
    EXPECT_NEAR(view.at("field_at_isocentre_mm").at(0), 200, 1e-9);  // 200 px of 1.5 mm, magnified by 1.5
    EXPECT_NEAR(view.at("detector_world_mm").at(2), 500 * std::sin(-10 * 3.14159265358979 / 180), 1e-6);
    EXPECT_THAT(view.at("assumptions").dump(), HasSubstr("LPS of a supine patient"));
}

TEST_F(GeometryCommand, VectorsAreWrittenAndReadBack) {
    const ProgramResult out = run_raylign({"geometry", folder.path("views.json"), "-o", folder.path("v.csv")});
    ASSERT_EQ(out.exit_code, 0) << out.err;
    const auto views = [&](const std::string& file) {
        return json::parse(run_raylign({"geometry", folder.path(file), "--json"}).out).at("views");
    };
    const json before = views("views.json"), after = views("v.csv");
    ASSERT_EQ(after.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(after[i].at("format"), "vectors");
        EXPECT_EQ(after[i].at("name"), before[i].at("name"));
        EXPECT_EQ(after[i].at("size_px"), before[i].at("size_px"));
        for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(after[i].at("source_world_mm")[k], before[i].at("source_world_mm")[k], 1e-9);
            EXPECT_NEAR(after[i].at("detector_world_mm")[k], before[i].at("detector_world_mm")[k], 1e-9);
        }
    }
}

TEST_F(GeometryCommand, WhatIsHardlySoIsDoubted) {
    write_text_file(folder.path("metres.json"), R"({ "raylign": 1, "views": [ { "name": "AP", "camera": {
        "size_px": [512, 512], "sdd_mm": 1.536, "pixel_pitch_mm": [0.48, 0.48], "principal_point_px": [255.5, 255.5] },
        "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]] } ] })");
    const ProgramResult result = run_raylign({"geometry", folder.path("metres.json")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("fx 3.2000"), HasSubstr("doubt       the detector is 1.536 mm"),
                                  HasSubstr("in metres?"), HasSubstr("focal length")));
    EXPECT_THAT(result.out, AllOf(HasSubstr("a camera's own frame"), testing::Not(HasSubstr("mirrored"))));
    const ProgramResult plain = run_raylign({"geometry", folder.path("views.json"), "--json"});
    EXPECT_TRUE(json::parse(plain.out).at("views").at(0).at("doubts").empty());
}

TEST_F(GeometryCommand, DistortionIsShownAndNotLostOnConversion) {
    write_text_file(folder.path("raw.txt"), std::string(kMayaCam) + "\nundistortion\n-0.2\n0.1\n0\n0\n0\n0\n0\n0\n");
    const std::string raw = folder.path("raw.txt");
    EXPECT_THAT(run_raylign({"geometry", raw}).err, AllOf(HasSubstr("undistortion"), HasSubstr("--undistorted")));
    const ProgramResult shown = run_raylign({"geometry", raw, "--undistorted", "false", "-o", folder.path("w.json")});
    ASSERT_EQ(shown.exit_code, 0) << shown.err;
    EXPECT_THAT(shown.out, AllOf(HasSubstr("distortion  k1 -0.2"), HasSubstr("undone on reading")));
    EXPECT_EQ(json::parse(read_text(folder.path("w.json"))).at("views").at(0).at("distortion").at(0), -0.2);
    EXPECT_THAT(run_raylign({"geometry", raw, "--undistorted", "false", "-o", folder.path("w.txt")}).err,
                HasSubstr("no place for the distortion"));
    EXPECT_EQ(run_raylign({"geometry", raw, "--undistorted", "true", "-o", folder.path("w.txt")}).exit_code, 0);
    EXPECT_THAT(run_raylign({"geometry", raw, "--undistorted", "yes"}).err, HasSubstr("true or false"));
}

TEST_F(GeometryCommand, ExtensionsAreComparedWithoutRegardToCase) {
    write_text_file(folder.path("VIEWS.JSON"), kCArm);
    const ProgramResult result = run_raylign({"geometry", folder.path("VIEWS.JSON"), "-o", folder.path("OUT.XML")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("(views.json, "));
    EXPECT_THAT(read_text(folder.path("OUT.XML")), HasSubstr("RTKThreeDCircularGeometry"));
    ASSERT_EQ(run_raylign({"geometry", folder.path("VIEWS.JSON"), "-o", folder.path("OUT.Json")}).exit_code, 0);
    EXPECT_EQ(json::parse(read_text(folder.path("OUT.Json"))).at("views").size(), 2U);
}

TEST_F(GeometryCommand, ConvertsThroughEveryFormatAndBack) {
    const std::string first = folder.path("a.json");
    ASSERT_EQ(run_raylign({"geometry", folder.path("cam.txt"), "--sdd", "1400", "-o", first}).exit_code, 0);
    std::string last = first;
    const std::vector<std::vector<std::string>> steps = {
        {"b.xml"},
        {"c.yml", "--size", "120,100", "--pixel-pitch", "0.7,0.66666666666666667"},
        {"d.txt", "--sdd", "1400"},
        {"e.plm", "--sdd", "1400", "--format", "plastimatch"},
        {"f.json", "--size", "120,100"}};
    for (const std::vector<std::string>& step : steps) {
        std::vector<std::string> arguments{"geometry", last, "-o", folder.path(step[0])};
        arguments.insert(arguments.end(), step.begin() + 1, step.end());
        const ProgramResult result = run_raylign(arguments);
        ASSERT_EQ(result.exit_code, 0) << step[0] << ": " << result.err;
        last = folder.path(step[0]);
    }
    const auto matrix = [](const std::string& file) {
        return json::parse(run_raylign({"geometry", file, "--json"}).out).at("views").at(0).at("projection_matrix");
    };
    const json before = matrix(first), after = matrix(last);
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 4; ++c) {
            EXPECT_NEAR(before.at(r).at(c).get<double>(), after.at(r).at(c).get<double>(), 1e-6) << r << ' ' << c;
        }
    }
}

TEST_F(GeometryCommand, JointTrackHasTheSourceInTheOrigin) {
    write_text_file(folder.path("c.txt"), "JT_INTCALIB\n1000\n10\n-5\n0.5\n");
    const ProgramResult result = run_raylign({"geometry", folder.path("c.txt"), "--size", "200,100"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, AllOf(HasSubstr("c  (JointTrack calibration"), HasSubstr("sdd 1000.000 mm"),
                                  HasSubstr("the world's origin is the source")));
}

TEST_F(GeometryCommand, FaultsAreUsageErrors) {
    const auto message = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "geometry");
        const ProgramResult result = run_raylign(arguments);
        EXPECT_EQ(result.exit_code, 2);
        return result.err;
    };
    const std::string cam = folder.path("cam.txt"), views = folder.path("views.json");
    EXPECT_THAT(message({folder.path("none.txt")}), HasSubstr("does not exist"));
    EXPECT_THAT(message({cam, "--size", "100,120"}), HasSubstr("120 x 100"));
    EXPECT_THAT(message({cam, "--size", "100"}), HasSubstr("--size"));
    EXPECT_THAT(message({cam, "--flip", "up"}), HasSubstr("none, columns or rows"));
    EXPECT_THAT(message({cam, "--flip", "rows"}), HasSubstr("mirrored"));
    EXPECT_THAT(message({cam, "-o", folder.path("a.xml")}), HasSubstr("sdd_mm"));
    EXPECT_THAT(message({cam, "-o", folder.path("a.abc")}), HasSubstr("--format"));
    EXPECT_THAT(message({cam, "-o", cam}), HasSubstr("overwrite"));
    EXPECT_THAT(message({views, "-o", folder.path("a.txt")}), HasSubstr("one view"));
    EXPECT_THAT(message({views, "--sdd", "5"}), HasSubstr("says them itself"));
    EXPECT_THAT(names_in(folder.folder()), testing::ElementsAre("cam.txt", "views.json"));
}

TEST(CArmAngles, SurviveEveryDirection) {
    for (const double primary : {-170.0, -90.0, 0.0, 33.0, 179.0}) {
        for (const double secondary : {-80.0, -15.0, 0.0, 60.0}) {
            const ViewGeometry view = view_from_c_arm({.sad_mm = 1,
                                                       .sdd_mm = 2,
                                                       .primary_angle_deg = primary,
                                                       .secondary_angle_deg = secondary,
                                                       .pixel_pitch_mm = {1, 1},
                                                       .size_px = {9, 9}});
            const apps::CArmAngles angles = apps::c_arm_angles(view.camera_from_world);
            EXPECT_NEAR(angles.primary_deg, primary, 1e-9);
            EXPECT_NEAR(angles.secondary_deg, secondary, 1e-9);
            EXPECT_NEAR(angles.in_plane_deg, 0, 1e-9);
        }
    }
}

}  // namespace
}  // namespace raylign::detail::test
