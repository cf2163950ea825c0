#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/report_page/page_script.h"
#include "tests/apps/small_case.h"

namespace raylign::detail::apps {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(Base64, HasTheValuesOfRfc4648) {
    EXPECT_EQ(base64(""), "");
    EXPECT_EQ(base64("f"), "Zg==");
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foo"), "Zm9v");
    EXPECT_EQ(base64("foob"), "Zm9vYg==");
    EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(ReportPage, LoadsNothingAndCannotBeBrokenByANameInIt) {
    const std::string page = report_page("study", R"({"name": "</script><img src=x>"})", {});
    EXPECT_THAT(page, StartsWith("<!DOCTYPE html>"));
    EXPECT_THAT(page, Not(HasSubstr("</script><img")));
    EXPECT_THAT(page, HasSubstr("\\u003c/script>\\u003cimg src=x>"));
    for (const char* loading : {"src=\"http", "href=\"http", "@import", "url(http", "@DATA@", "@SCRIPT@", "@STYLE@",
                                "@MAIN@", "@LIBRARIES@"}) {
        EXPECT_THAT(page, Not(HasSubstr(loading)));
    }
}

TEST(ReportPage, CarriesThePartOfAnotherRoomWithItsData) {
    const std::string page =
        report_page("register", "{}", {}, {}, {"globalThis.part = 1;", {{"part", R"("</script>")"}}});
    EXPECT_THAT(page, HasSubstr("globalThis.part = 1;</script>"));
    EXPECT_THAT(page, HasSubstr(R"("part":"\u003c/script>")"));
    EXPECT_LT(page.find("globalThis.part"), page.find("registerPage"));  // before the script that calls it
}

TEST(PageLayer, IsAPngInThePageAndLeavesNoFile) {
    const test::TestFolder folder;
    Image image(4, 4, 1);
    image(1, 1) = 3;
    const PageLayer layer = page_layer("X-ray", image, {}, folder.folder());
    EXPECT_THAT(layer.uri, StartsWith("data:image/png;base64,iVBORw0KGgo"));
    EXPECT_TRUE(test::names_in(folder.folder()).empty());
}

}  // namespace
}  // namespace raylign::detail::apps
