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
    for (const char* loading : {"src=\"", "href=\"http", "@import", "url(http", "@DATA@", "@SCRIPT@", "@STYLE@"}) {
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
    EXPECT_NE(page.find("\"start\":[[0.99862953"), std::string::npos);
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
