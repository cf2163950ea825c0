#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/apps/run_program.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// A report of a view LAT that wants to be turned by z_deg about z and moved by x_mm, at a centre off the origin.
void write_case(const TestFolder& folder, const std::string& name, double z_deg, double x_mm) {
    const json correction = {{"rotation_deg", {0, 0, z_deg}},
                             {"translation_mm", {x_mm, 0, 0}},
                             {"rotation_sigma_deg", {0.1, 0.1, 0.1}},
                             {"translation_sigma_mm", {0.2, 0.2, 0.2}},
                             {"centre_world_mm", {0, 0, 50}}};
    const json views = {{{"name", "AP"}, {"correction", nullptr}}, {{"name", "LAT"}, {"correction", correction}}};
    std::filesystem::create_directories(folder.folder() / name);
    write_text_file(folder.path(name + "/report.json"), json{{"views", views}}.dump());
}

TEST(GeometryCheck, TellsWhatCasesHaveInCommon) {
    const TestFolder folder;
    write_case(folder, "cases/a", 1.3, 0.5);
    write_case(folder, "cases/b", 1.4, -0.5);
    write_case(folder, "cases/c", 1.5, 0);
    const ProgramResult result = run_raylign({"geometry", "--check", folder.path("cases"), "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json check = json::parse(result.out);
    EXPECT_EQ(check.at("reports"), 3);
    EXPECT_EQ(check.at("views").at(0).at("cases"), 0);
    EXPECT_EQ(check.at("views").at(0).at("without_correction"), 3);
    const json& lat = check.at("views").at(1);
    EXPECT_EQ(lat.at("name"), "LAT");
    EXPECT_NEAR(lat.at("rotation_deg").at("mean").at(2), 1.4, 1e-9);
    EXPECT_NEAR(lat.at("rotation_deg").at("spread").at(2), 0.1, 1e-9);
    EXPECT_NEAR(lat.at("rotation_deg").at("error").at(2), 0.1 / std::sqrt(3.0), 1e-9);
    EXPECT_NEAR(lat.at("translation_mm").at("mean").at(0), 0, 1e-9) << "a turn about z moves no point of that axis";
    EXPECT_NEAR(lat.at("translation_mm").at("spread").at(0), 0.5, 1e-9);
    EXPECT_EQ(lat.at("is_systematic"), true);
}

TEST(GeometryCheck, TellsPeople) {
    const TestFolder folder;
    write_case(folder, "a", 1.3, 0);
    write_case(folder, "b", -1.3, 0);
    write_case(folder, "c", 0.1, 0);
    const ProgramResult result =
        run_raylign({"geometry", "--check", folder.path("a"), folder.path("b"), folder.path("c")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("LAT  (3 cases)"));
    EXPECT_THAT(result.out, HasSubstr("none that is the same in all cases"));
    EXPECT_THAT(run_raylign({"geometry", "--check", folder.path("a")}).out, HasSubstr("too few cases"));
}

TEST(GeometryCheck, RefusesWhatIsNoReport) {
    const TestFolder folder;
    const auto refused = [](const std::vector<std::string>& arguments, const char* why) {
        const ProgramResult result = run_raylign(arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_THAT(result.err, HasSubstr(why));
    };
    refused({"geometry", "--check", folder.path("nowhere")}, "no report.json in it");
    refused({"geometry", "--check", folder.folder().string()}, "no report.json in it");
    write_case(folder, "a", 1, 0);
    refused({"geometry", "--check", folder.path("a"), "-o", folder.path("x.json")}, "--check reads reports");
    write_text_file(folder.path("a/report.json"),
                    R"({"views": [{"name": "AP", "correction": {"rotation_deg": [1]}}]})");
    refused({"geometry", "--check", folder.path("a")}, "rotation_deg");
    write_text_file(folder.path("a/report.json"), "[1, 2");
    refused({"geometry", "--check", folder.path("a")}, "report.json");
    write_text_file(folder.path("a/report.json"), R"({"trials": 3})");
    refused({"geometry", "--check", folder.path("a")}, "views");
}

}  // namespace
}  // namespace raylign::detail::test
