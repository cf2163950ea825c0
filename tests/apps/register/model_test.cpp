// A surface of triangles instead of a CT.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "raylign/io/pose.h"
#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

/// Faces of a box, outwards, as ASCII STL.
std::string box_facets(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    constexpr int kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    std::string text;
    for (const auto& face : kFaces) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const int i : face) {
            text += "vertex " + std::to_string(i & 1 ? high.x() : low.x()) + " " +
                    std::to_string(i & 2 ? high.y() : low.y()) + " " + std::to_string(i & 4 ? high.z() : low.z()) +
                    "\n";
        }
        text += "endloop\nendfacet\n";
    }
    return text;
}

class RegisterModel : public testing::Test {
protected:
    void SetUp() override {
        write_text_file(folder.path("part.stl"), "solid part\n" + box_facets({-60, -20, -50}, {-20, 20, 60}) +
                                                     box_facets({-30, -10, -50}, {70, 15, -15}) +
                                                     box_facets({10, -40, -40}, {40, 5, -20}) + "endsolid part\n");
    }
    [[nodiscard]] std::vector<std::string> arguments(const char* command, const std::vector<std::string>& more) const {
        std::vector<std::string> list{command, "-v", folder.path("part.stl"), "--backend", "cpu"};
        list.insert(list.end(), more.begin(), more.end());
        return list;
    }

    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(RegisterModel, FindsThePoseOfAnImplant) {
    const ProgramResult drr =
        run_raylign(arguments("drr", {"--material", "MU=0.02", "--views", folder.path("geometry.json"), "--pose",
                                      folder.path("truth.json"), "-o", folder.path("xrays")}));
    ASSERT_EQ(drr.exit_code, 0) << drr.err;
    const ProgramResult run = run_raylign(arguments(
        "register", {"--material", "MU=0.02", "--views", folder.path("xrays/views.json"), "--start",
                     folder.path("start.json"), "--truth", folder.path("truth.json"), "-o", folder.path("result")}));
    EXPECT_LE(run.exit_code, 1) << run.err;
    const json report = json::parse(read_text(folder.path("result/report.json")));
    EXPECT_LT(report.at("tre").at("final_mtre_mm"), 0.3) << "a pixel there is 4 mm";
    EXPECT_GT(report.at("tre").at("initial_mtre_mm"), 5);
    const std::string notes = report.at("notes").dump();
    EXPECT_THAT(notes, AllOf(HasSubstr("36 triangles"), HasSubstr("two thirds of a pixel of the views"),
                             HasSubstr("count once")));
    EXPECT_THAT(notes, testing::Not(HasSubstr("saturat"))) << "no metal";
}

TEST_F(RegisterModel, DrrsAreMadeFromItsTrianglesUnlessVoxelsAreAskedFor) {
    write_text_file(folder.path("part.stl"), "solid part\n" + box_facets({-60, -20, -50}, {-20, 20, 60}) +
                                                 box_facets({-15, -10, -50}, {70, 15, -15}) + "endsolid part\n");
    const auto drr = [&](const std::string& name, const std::vector<std::string>& more) {
        std::vector<std::string> list{"--material", "MU=0.02",
                                      "--views",    folder.path("geometry.json"),
                                      "--pose",     folder.path("truth.json"),
                                      "-o",         folder.path(name)};
        list.insert(list.end(), more.begin(), more.end());
        return run_raylign(arguments("drr", list));
    };
    const ProgramResult exact = drr("exact", {}), voxels = drr("voxels", {"--mesh-drr", "voxels"});
    ASSERT_EQ(exact.exit_code, 0) << exact.err;
    ASSERT_EQ(voxels.exit_code, 0) << voxels.err;
    EXPECT_NE(read_text(folder.path("exact/drr_AP.tif")), read_text(folder.path("voxels/drr_AP.tif")));
    EXPECT_EQ(drr("other", {"--mesh-drr", "cubes"}).exit_code, 2);
    EXPECT_THAT(drr("other", {"--mesh-drr", "cubes"}).err, HasSubstr("triangles or voxels"));
    const ProgramResult run = run_raylign(arguments(
        "register", {"--material", "MU=0.02", "--views", folder.path("exact/views.json"), "--start",
                     folder.path("start.json"), "--truth", folder.path("truth.json"), "-o", folder.path("result")}));
    EXPECT_LE(run.exit_code, 1) << run.err;
    const json report = json::parse(read_text(folder.path("result/report.json")));
    EXPECT_THAT(report.at("notes").dump(), HasSubstr("DRRs are made from 24 triangles"));
    EXPECT_EQ(report.at("levels").back().at("engine_volume_layout"), "24 triangles");
    EXPECT_LT(report.at("tre").at("final_mtre_mm"), 0.1) << "a pixel there is 4 mm";
}

TEST_F(RegisterModel, AStudySimulatesItsXraysByOtherRays) {
    write_text_file(folder.path("part.stl"), "solid part\n" + box_facets({-60, -20, -50}, {40, 20, 60}) + "endsolid\n");
    const ProgramResult run = run_raylign(arguments(
        "study", {"--material", "MU=0.02", "--views", folder.path("geometry.json"), "--truth",
                  folder.path("truth.json"), "--bins", "4:4:8", "--per-bin", "1", "-o", folder.path("study")}));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(read_text(folder.path("study/study.json")), HasSubstr("6 x 6 rays a pixel"));
}

TEST_F(RegisterModel, WhatItIsMadeOfMustBeSaid) {
    const std::vector<std::string> more{"--views", folder.path("geometry.json"), "--pose", folder.path("truth.json"),
                                        "-o",      folder.path("xrays")};
    const ProgramResult run = run_raylign(arguments("drr", more));
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, AllOf(HasSubstr("part.stl"), HasSubstr("--material")));
    auto ct = arguments("drr", more);
    ct[2] = folder.path("spine.mha");
    ct.insert(ct.end(), {"--material", "bone"});
    EXPECT_THAT(run_raylign(ct).err, HasSubstr("is no model"));
}

}  // namespace
}  // namespace raylign::detail::test
