#include "apps/shared/json_text.h"

#include <gmock/gmock.h>

#include "core/base/error.h"
#include "tests/support/errors.h"

namespace raylign::detail::apps {
namespace {

TEST(JsonText, EscapesWhatTerminalsObey) {
    const std::string name =
        "a\x1b[2J\x7f\xc2\x9b"
        "31m \xc3\xa4\n";
    const std::string text = one_line(Json(name));
    EXPECT_EQ(text, "\"a\\u001b[2J\\u007f\\u009b31m \xc3\xa4\\n\"");
    EXPECT_EQ(Json::parse(text).get<std::string>(), name);
    EXPECT_EQ(one_line(Json("\xc2\x80")), "\"\\u0080\"");
}

TEST(JsonText, LinesOfAnyDepthAreReadOrRefused) {
    EXPECT_EQ(json_of_line(R"({"a":"[[[\\"})").at("a"), "[[[\\");
    EXPECT_THAT(test::error_of([] { (void)json_of_line(std::string(200000, '[')); }), testing::HasSubstr("nested"));
    EXPECT_THAT(test::error_of([] { (void)json_of_line("{"); }), testing::HasSubstr("no JSON"));
}

}  // namespace
}  // namespace raylign::detail::apps
