#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/viewer/viewer_page.h"
#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using testing::HasSubstr;

class Place : public testing::Test {
protected:
    void SetUp() override {
        if (!apps::has_viewer()) GTEST_SKIP() << "built without npm";
        ASSERT_EQ(small.make_phantom().exit_code, 0);
    }
    ProgramResult place(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"place", "-v", folder.path("spine.mha"), "--attenuation"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_raylign(arguments);
    }
    TestFolder folder;
    SmallCase small{folder};
};

TEST_F(Place, LeavesOnePageThatLoadsNothingAndSaysHowToGoOn) {
    const ProgramResult result =
        place({"--views", folder.path("geometry.json"), "--label", "1", "-o", folder.path("a b.html")});
    EXPECT_EQ(result.exit_code, 2) << "--label needs --labels";
    const ProgramResult good = place({"--views", folder.path("geometry.json"), "-o", folder.path("a b.html")});
    ASSERT_EQ(good.exit_code, 0) << good.err;
    EXPECT_THAT(good.out,
                HasSubstr("raylign register --volume " + folder.path("spine.mha") + " --attenuation --views " +
                          folder.path("geometry.json") + " --start start.json -o result\n"));
    const std::string page = read_text(folder.path("a b.html"));
    EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
    for (const char* loading :
         {"src=\"", "href=\"http", "@import", "url(http", "@DATA@", "@SCRIPT@", "@STYLE@", "@MAIN@", "@LIBRARIES@"}) {
        EXPECT_EQ(page.find(loading), std::string::npos) << loading;
    }
}

TEST_F(Place, StartsFromThePoseThatIsGiven) {
    ASSERT_EQ(place({"--views", folder.path("geometry.json"), "--start", folder.path("truth.json"), "-o",
                     folder.path("p.html")})
                  .exit_code,
              0);
    const std::string page = read_text(folder.path("p.html"));
    // A failure must not print the page.
    EXPECT_NE(page.find("\"poses\":[[[0.99862953"), std::string::npos);
}

TEST_F(Place, NamesSeveralObjectsAsRegisterDoes) {
    ASSERT_EQ(
        run_raylign({"phantom", "spine", "--size", "24", "--spacing", "4", "-o", folder.path("small.mha")}).exit_code,
        0);
    const std::vector<std::string> objects{
        "--bone",  "one=" + folder.path("spine.mha"), "--bone", "two=" + folder.path("small.mha"), "--attenuation",
        "--views", folder.path("geometry.json")};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), objects.begin(), objects.end());
        more.insert(more.begin(), "place");
        return run_raylign(more);
    };
    const ProgramResult result = with({"--start", "one=" + folder.path("truth.json"), "-o", folder.path("two.html")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("--start start.csv -o result\n"));
    const std::string page = read_text(folder.path("two.html"));
    EXPECT_NE(page.find("\"name\":\"one\""), std::string::npos);
    EXPECT_NE(page.find("\"name\":\"two\""), std::string::npos);
    const ProgramResult twice = with({"-v", folder.path("spine.mha"), "-o", folder.path("x.html")});
    EXPECT_EQ(twice.exit_code, 2);
    EXPECT_THAT(twice.err, HasSubstr("--bone NAME=FILE contradicts -v"));
    const ProgramResult none =
        run_raylign({"place", "--views", folder.path("geometry.json"), "-o", folder.path("x.html")});
    EXPECT_EQ(none.exit_code, 2);
    EXPECT_THAT(none.err, HasSubstr("no CT"));
}

TEST_F(Place, NeverReplacesAnInput) {
    const ProgramResult result = place({"--views", folder.path("geometry.json"), "-o", folder.path("geometry.json")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("would overwrite the input"));
    EXPECT_THAT(read_text(folder.path("geometry.json")), HasSubstr("views"));
}

TEST_F(Place, NamesWhatIsMissing) {
    const ProgramResult no_views = place({"-o", folder.path("p.html")});
    EXPECT_EQ(no_views.exit_code, 2);
    EXPECT_THAT(no_views.err, HasSubstr("--views"));
    const ProgramResult no_folder =
        place({"--views", folder.path("geometry.json"), "-o", folder.path("none/there/p.html")});
    EXPECT_EQ(no_folder.exit_code, 2);
    EXPECT_THAT(no_folder.err, HasSubstr("none/there"));
    write_text_file(folder.path("no_views.json"), R"({"raylign": 1, "views": []})");
    EXPECT_EQ(place({"--views", folder.path("no_views.json"), "-o", folder.path("p.html")}).exit_code, 2);
}

}  // namespace
}  // namespace raylign::detail::test
