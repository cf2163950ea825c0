#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdio>

#include "apps/shared/first_guess.h"
#include "apps/shared/options.h"
#include "core/base/error.h"
#include "raylign/io/pose.h"
#include "tests/apps/small_case.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

using apps::first_guess;
using apps::FirstGuess;
using apps::StartFlags;
using testing::Contains;
using testing::HasSubstr;

const std::vector<std::pair<const char*, Eigen::Vector3d>> kPoints = {
    {"a", {10, 20, -30}}, {"b", {-25, 5, 12}}, {"c", {30, -15, 22}}, {"d", {-8, -28, -3}}, {"e", {3, 14, 35}}};

/// Two views of the small case and the landmarks as they are seen at `world_from_ct`.
class Guess : public testing::Test {
protected:
    void SetUp() override {
        views = read_views(std::vector<std::string>{folder.path("geometry.json")}, ReadImages::never);
        std::string text;
        char line[128];
        for (const auto& [name, x] : kPoints) {
            std::snprintf(line, sizeof line, "%s,%.17g,%.17g,%.17g\n", name, x.x(), x.y(), x.z());
            text += line;
        }
        write_text_file(folder.path("ct.csv"), text);
        for (std::size_t v = 0; v < 2; ++v) {
            text.clear();
            for (const auto& [name, x] : kPoints) {
                const Eigen::Vector2d pixel = project(views.views[v].geometry, world_from_ct * x);
                std::snprintf(line, sizeof line, "%s,%.17g,%.17g\n", name, pixel.x(), pixel.y());
                text += line;
            }
            write_text_file(folder.path(views.views[v].name + ".csv"), text);
        }
    }
    [[nodiscard]] std::string seen_in(const std::string& view) const { return view + "=" + folder.path(view + ".csv"); }

    TestFolder folder;
    SmallCase scene{folder};
    ViewsFile views;
    const RigidTransform world_from_ct = exp((Twist() << 0.9, -0.4, 1.7, 12, -9, 4).finished());
    const VoxelGrid grid{{64, 64, 64}, {3.5, 3.5, 3.5}};
};

TEST_F(Guess, LandmarksOnDistortedImagesAreMovedAsTheImagesAre) {
    const Distortion distortion{-0.3, 0.1, 0.01, -0.02, 0.05};
    StartFlags flags{"", folder.path("ct.csv"), {}};
    double most = 0;
    for (std::size_t v = 0; v < 2; ++v) {
        std::string text;
        for (const auto& [name, x] : kPoints) {
            const ViewGeometry& view = views.views[v].geometry;
            const Eigen::Vector2d seen = project(view, world_from_ct * x);
            const Eigen::Vector2d stored = distorted_px(view.camera, distortion, seen);
            most = std::max(most, (stored - seen).norm());
            text += name + ("," + std::to_string(stored.x()) + "," + std::to_string(stored.y()) + "\n");
        }
        write_text_file(folder.path(views.views[v].name + "_raw.csv"), text);
        flags.landmarks.push_back(views.views[v].name + "=" + folder.path(views.views[v].name + "_raw.csv"));
        views.origins[v].distortion = distortion;
    }
    ASSERT_GT(most, 0.01) << "there is something to undo";
    const FirstGuess guess = first_guess(flags, grid, views);
    EXPECT_LT((to_matrix(guess.world_from_ct) - to_matrix(world_from_ct)).norm(), 1e-3);
}

TEST_F(Guess, LandmarksInTwoViewsGiveThePose) {
    const FirstGuess guess = first_guess({"", folder.path("ct.csv"), {seen_in("AP"), seen_in("LAT")}}, grid, views);
    EXPECT_LT((to_matrix(guess.world_from_ct) - to_matrix(world_from_ct)).norm(), 1e-6);
    EXPECT_THAT(guess.notes, Contains(HasSubstr("10 landmark points")));
    EXPECT_EQ(guess.files.size(), 3U);
}

TEST_F(Guess, PointsAreMarkedOnThePixelsAsStored) {
    // The stored AP image is mirrored: its points lie at 63 - x.
    std::string text;
    char line[128];
    for (const auto& [name, x] : kPoints) {
        const Eigen::Vector2d pixel = project(views.views[0].geometry, world_from_ct * x);
        std::snprintf(line, sizeof line, "%s,%.17g,%.17g\n", name, 63 - pixel.x(), pixel.y());
        text += line;
    }
    write_text_file(folder.path("AP.csv"), text);
    views.origins[0].flip = ImageFlip::columns;
    const FirstGuess guess = first_guess({"", folder.path("ct.csv"), {seen_in("AP"), seen_in("LAT")}}, grid, views);
    EXPECT_LT((to_matrix(guess.world_from_ct) - to_matrix(world_from_ct)).norm(), 1e-6);
}

TEST_F(Guess, SwappedPointsAreDoubted) {
    write_text_file(folder.path("ct.csv"), "a,10,20,-30\nc,-25,5,12\nb,30,-15,22\nd,-8,-28,-3\ne,3,14,35\n");
    const FirstGuess guess = first_guess({"", folder.path("ct.csv"), {seen_in("AP"), seen_in("LAT")}}, grid, views);
    EXPECT_THAT(guess.notes, Contains(HasSubstr("fit badly")));
}

TEST_F(Guess, FaultsAreNamed) {
    const std::string ct = folder.path("ct.csv");
    EXPECT_THAT(error_of([&] { (void)first_guess({"", ct, {"PA=x.csv"}}, grid, views); }), HasSubstr("one of AP, LAT"));
    write_text_file(folder.path("AP.csv"), "z,1,2\n");
    EXPECT_THAT(error_of([&] {
                    (void)first_guess({"", ct, {seen_in("AP")}}, grid, views);
                }),
                HasSubstr("one of the landmarks a, b, c, d, e"));
    write_text_file(folder.path("AP.csv"), "a,1,2\nb,3,4\nc,5,9\n");
    EXPECT_THAT(error_of([&] { (void)first_guess({"", ct, {seen_in("AP")}}, grid, views); }), HasSubstr("at least 4"));
    EXPECT_THAT(error_of([&] {
                    apps::settle_conflicts(StartFlags{"", ct, {}});
                }),
                HasSubstr("give --landmarks VIEW=FILE"));
    EXPECT_THAT(error_of([&] {
                    apps::settle_conflicts(StartFlags{"", "", {"AP=x"}});
                }),
                HasSubstr("give --landmarks3d"));
    EXPECT_THAT(error_of([&] {
                    apps::settle_conflicts(StartFlags{"pose.json", ct, {"AP=x"}});
                }),
                HasSubstr("contradicts"));
    EXPECT_THAT(error_of([&] { apps::settle_conflicts(StartFlags{"", ct, {"AP"}}); }), HasSubstr("VIEW=FILE"));
}

TEST_F(Guess, DicomNeedsDicomViews) {
    EXPECT_THAT(error_of([&] { (void)first_guess({"dicom", "", {}}, grid, views); }), HasSubstr("view AP is not from"));
    for (ViewOrigin& origin : views.origins) origin.is_dicom_geometry = true;
    const FirstGuess guess = first_guess({"dicom", "", {}}, grid, views);
    EXPECT_LT((guess.world_from_ct * grid.centre_ct_mm()).norm(), 1e-6);  // the CT's middle in the isocentre
    EXPECT_THAT(first_guess({"", "", {}}, grid, views).notes, Contains(HasSubstr("start by DICOM")));
    views.origins[1].isocentre_ct_mm = Eigen::Vector3d(1, 2, 3);
    EXPECT_LT((first_guess({"dicom", "", {}}, grid, views).world_from_ct * Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST_F(Guess, RegisterStartsFromLandmarks) {
    ASSERT_EQ(scene.make_phantom().exit_code, 0);
    ASSERT_EQ(scene.simulate().exit_code, 0);
    const RigidTransform truth = read_pose(folder.path("truth.json"));
    char line[128];
    for (const View& view : views.views) {
        std::string text;
        for (const auto& [name, x] : kPoints) {
            const Eigen::Vector2d pixel = project(view.geometry, truth * x);
            std::snprintf(line, sizeof line, "%s,%.2f,%.2f\n", name, pixel.x(), pixel.y());
            text += line;
        }
        write_text_file(folder.path(view.name + ".csv"), text);
    }
    std::vector<std::string> arguments =
        scene.register_arguments({"--landmarks3d", folder.path("ct.csv"), "--landmarks", seen_in("AP"), seen_in("LAT"),
                                  "--truth", folder.path("truth.json")});
    const auto start = std::ranges::find(arguments, "--start");
    arguments.erase(start, start + 2);
    const ProgramResult result = run_raylign(arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
    const auto report = nlohmann::json::parse(read_text(folder.path("result/report.json")));
    EXPECT_LT(report.at("tre").at("initial_mtre_mm"), 0.2);
    EXPECT_THAT(report.at("notes").dump(), HasSubstr("landmark points"));
}

}  // namespace
}  // namespace raylign::detail::test
