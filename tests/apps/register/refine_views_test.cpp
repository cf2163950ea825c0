#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "raylign/io/views.h"
#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class RefineViewsCommand : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(scene.make_phantom().exit_code, 0);
        ASSERT_EQ(scene.simulate().exit_code, 0);
    }
    [[nodiscard]] ProgramResult refine(const std::vector<std::string>& more = {}) const {
        std::vector<std::string> arguments = scene.register_arguments({"--refine-views"});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_raylign(arguments);
    }
    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(RefineViewsCommand, LeavesViewsThatTheNextRunTakes) {
    const ProgramResult result = refine();
    ASSERT_LE(result.exit_code, 1) << result.err;
    const ViewsFile given = read_views(folder.path("xrays/views.json"), ReadImages::required);
    const ViewsFile refined = read_views(folder.path("result/views_refined.json"), ReadImages::required);
    ASSERT_EQ(refined.views.size(), 2u);
    EXPECT_EQ(refined.views[1].image.pixels, given.views[1].image.pixels);
    EXPECT_EQ(to_matrix(refined.views[0].geometry.camera_from_world),
              to_matrix(given.views[0].geometry.camera_from_world))
        << "the first stays";
    const json views = json::parse(read_text(folder.path("result/report.json"))).at("views");
    EXPECT_TRUE(views.at(0).at("correction").is_null());
    EXPECT_EQ(views.at(1).at("correction").at("applied"), true);
    const Eigen::Matrix4d camera = to_matrix(refined.views[1].geometry.camera_from_world);
    EXPECT_NEAR(views.at(1).at("camera_from_world").at(0).at(3), camera(0, 3), 1e-9);
}

TEST_F(RefineViewsCommand, KeepsTheViewThatIsNamed) {
    ASSERT_LE(refine({"--keep-view", "LAT", "--view-prior", "0.5,2"}).exit_code, 1);
    const json views = json::parse(read_text(folder.path("result/report.json"))).at("views");
    EXPECT_TRUE(views.at(1).at("correction").is_null());
    EXPECT_FALSE(views.at(0).at("correction").is_null());
}

TEST_F(RefineViewsCommand, RefusesWhatContradictsIt) {
    const auto refused = [](const ProgramResult& result, const char* why) {
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr(why));
    };
    refused(refine({"--time-limit", "5"}), "--refine-views contradicts --time-limit");
    refused(refine({"--method", "bobyqa"}), "leave --method bobyqa out");
    refused(refine({"--view-prior", "1"}), "--view-prior");
    refused(refine({"--view-prior", "0,5"}), "--view-prior = 0,5: must be DEG,MM");
    refused(refine({"--view-prior", "nan,5"}), "--view-prior");
    refused(refine({"--keep-view", "PA"}), "--keep-view = PA: must be AP, LAT or none");
    refused(run_raylign(scene.register_arguments({"--view-prior", "1,5"})), "no meaning without --refine-views");
    refused(run_raylign(scene.register_arguments({"--keep-view", "AP"})), "no meaning without --refine-views");
    EXPECT_THAT(names_in(folder.folder()), testing::Not(testing::Contains("result")));
}

TEST_F(RefineViewsCommand, RefusesASingleView) {
    json views = json::parse(read_text(folder.path("xrays/views.json")));
    views.at("views").erase(1);
    write_text_file(folder.path("xrays/views.json"), views.dump());
    const ProgramResult result = refine();
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("one view cannot tell its camera's error"));
}

}  // namespace
}  // namespace raylign::detail::test
