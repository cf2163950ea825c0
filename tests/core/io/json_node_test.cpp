#include "core/io/files/json_node.h"

#include <gmock/gmock.h>

#include "io_files.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class JsonFiles : public test::IoTest {
protected:
    std::string message(const std::string& text) {
        return error_of([&] { (void)read_json(write("a.json", text)); });
    }
};

TEST_F(JsonFiles, DeepNestingIsAnErrorAndNoOverflow) {
    constexpr std::size_t kLevels = 200000;
    const std::string arrays(kLevels, '[');
    std::string objects;
    for (std::size_t i = 0; i < kLevels; ++i) objects += "{\"a\":";
    for (const std::string& text : {arrays + std::string(kLevels, ']'), arrays, objects, "{\"k\":" + arrays}) {
        EXPECT_THAT(message(text), AllOf(HasSubstr("a.json"), HasSubstr("64 levels"))) << text.substr(0, 12);
    }
}

TEST_F(JsonFiles, WhatJsonDoesNotHaveIsNamed) {
    EXPECT_THAT(message(R"({"a": NaN})"), AllOf(HasSubstr("line 1, column 7"), HasSubstr("JSON has no NaN")));
    EXPECT_THAT(message(R"({"a": Infinity})"), HasSubstr("JSON has no Infinity"));
    EXPECT_THAT(message(R"({"a": -Infinity})"), HasSubstr("JSON has no Infinity"));
    EXPECT_THAT(message("{\"a\": 1} // x"), HasSubstr("JSON has no comments"));
    EXPECT_THAT(message(R"({"a": 1e999})"), HasSubstr("line 1, column 11"));
    EXPECT_THAT(message(std::string("{\"a\": 1}\0", 9)), HasSubstr("a NUL byte at line 1, column 9"));
    EXPECT_THAT(message(std::string("{\"a\0\": 1}", 9)), HasSubstr("a NUL byte"));
    EXPECT_THAT(message(std::string("{\0}\0", 4)), HasSubstr("UTF-16"));
    EXPECT_THAT(message(std::string("\xFE\xFF\0{\0}", 6)), HasSubstr("UTF-16"));
}

TEST_F(JsonFiles, AKeyGivenTwiceIsAnErrorWhateverItIs) {
    EXPECT_THAT(message(R"({"a": 1, "a": 1})"), HasSubstr("key \"a\" is given twice"));
    EXPECT_THAT(message(R"({"": 1, "": 2})"), HasSubstr("key \"\" is given twice"));
    EXPECT_NO_THROW((void)read_json(write("b.json", R"({"a": {"b": 1}, "c": {"b": 1}})")));
}

TEST_F(JsonFiles, MessagesAreShortAndOurOwn) {
    for (const std::string& text :
         {"{\"a\": \"" + std::string(100000, 'x'), std::string(100000, '9'), std::string("{\"a\": \"\xFF\"}"),
          std::string("{\"a\": \"\\ud800\"}"), std::string("nul"), std::string("{\"a\": 1"), std::string("]")}) {
        const std::string shown = message(text);
        EXPECT_LT(shown.size(), 600U);
        EXPECT_THAT(shown,
                    AllOf(HasSubstr("a.json is not valid JSON"), Not(HasSubstr("exception")), Not(HasSubstr("::"))));
    }
}

TEST_F(JsonFiles, NamesThatAreNoUtf8AreWrittenAllTheSame) {
    EXPECT_EQ(json_text({{"name", "a\xFF"}}), "{\n  \"name\": \"a\xEF\xBF\xBD\"\n}\n");
    EXPECT_EQ(read_json(write("bom.json", "\xEF\xBB\xBF{\"a\": 1}")).at("a"), 1);
}

}  // namespace
}  // namespace raylign::detail
