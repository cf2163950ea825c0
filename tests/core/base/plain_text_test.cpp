#include "core/base/plain_text.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "core/base/error.h"
#include "core/base/fault_text.h"

namespace raylign::detail {
namespace {

TEST(PlainText, ControlCharactersAreShownAndLettersStay) {
    EXPECT_EQ(plain_text("a\x1b[2J\r\n\tb\x7f"), "a\\x1b[2J\\x0d\\n\\tb\\x7f");
    EXPECT_EQ(plain_text(std::string_view("a\0b", 3)), "a\\x00b");
    EXPECT_EQ(plain_text("B\xc3\xa4r \xe2\x82\xac \xf0\x9f\xa6\xb4"), "B\xc3\xa4r \xe2\x82\xac \xf0\x9f\xa6\xb4");
}

TEST(PlainText, BytesThatAreNoUtf8AreShown) {
    EXPECT_EQ(plain_text("a\xff\xc3"), "a\\xff\\xc3");
    EXPECT_EQ(plain_text("\xc2\x9b"
                         "31m"),
              "\\xc2\\x9b31m")
        << "U+009B begins an escape sequence, too";
    EXPECT_EQ(plain_text("\xe2\x82"), "\\xe2\\x82");
}

TEST(PlainText, LongTextIsCutWithTheCount) {
    const std::string cut = plain_text("head" + std::string(1000000, 'x') + "tail", 100);
    EXPECT_EQ(cut, "head" + std::string(71, 'x') + " ... (999908 bytes left out) ... " + std::string(21, 'x') + "tail");
    EXPECT_EQ(plain_text(std::string(100, 'x'), 100), std::string(100, 'x'));
}

TEST(PlainText, MessagesKeepTheirListsAndPagesTheirLines) {
    EXPECT_EQ(plain_message("choose:\n  1: a\n  2: b\nraylign: forged"), "choose:\n  1: a\n  2: b\\nraylign: forged");
    EXPECT_EQ(plain_page("a\nb\x1b\n"), "a\nb\\x1b\n");
}

TEST(FaultText, SpeaksNoCpp) {
    EXPECT_EQ(fault_text(Error("step = 0")), "step = 0");
    EXPECT_EQ(fault_text(std::bad_alloc()), "not enough memory");
    EXPECT_EQ(fault_text(std::length_error("vector::_M_default_append")), "not enough memory");
    EXPECT_EQ(fault_text(std::filesystem::filesystem_error("status", "x.nii",
                                                           std::make_error_code(std::errc::permission_denied))),
              "x.nii cannot be used: Permission denied");
    EXPECT_EQ(fault_text(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again))),
              "the system refuses: Resource temporarily unavailable");
    for (const char* text : {"stoi", "basic_string::substr: __pos (which is 5) > this->size() (which is 3)",
                             "[json.exception.type_error.302] type must be number, but is string", "map::at"}) {
        EXPECT_THAT(fault_text(std::out_of_range(text)), testing::StartsWith("a fault that raylign did not foresee"));
    }
    EXPECT_EQ(fault_text(std::runtime_error("the device was taken away")), "the device was taken away");
}

}  // namespace
}  // namespace raylign::detail
