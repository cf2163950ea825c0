#include "core/base/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "core/base/median.h"
#include "core/base/names.h"
#include "core/base/number_text.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

using Words = std::vector<std::string>;

TEST(Joined, PutsTheSeparatorBetweenWordsOnly) {
    EXPECT_EQ(joined(Words{"a", "b", "c"}), "a, b, c");
    EXPECT_EQ(joined(Words{"a", "b"}, " and "), "a and b");
    EXPECT_EQ(joined(Words{"alone"}), "alone");
    EXPECT_EQ(joined(Words{}), "");
}

TEST(TextOf, WritesItsPartsOneAfterTheOther) { EXPECT_EQ(text_of("x = ", 3, ", y = ", 0.5, 'm'), "x = 3, y = 0.5m"); }

TEST(Fixed, HasTheDigitsAskedFor) {
    EXPECT_EQ(fixed(3.14159, 2), "3.14");
    EXPECT_EQ(fixed(2, 3), "2.000");
    EXPECT_EQ(fixed(-0.5, 1), "-0.5");
    EXPECT_EQ(fixed(1234.5678, 0), "1235");
}

TEST(Fixed, RoundsToNearest) {
    EXPECT_EQ(fixed(0.0046, 2), "0.00");
    EXPECT_EQ(fixed(0.0054, 2), "0.01");
    EXPECT_EQ(fixed(9.996, 2), "10.00");
}

TEST(Fixed, WritesWhatIsNoFiniteNumberAndWhatIsVeryLong) {
    EXPECT_EQ(fixed(std::numeric_limits<double>::quiet_NaN(), 2), "nan");
    EXPECT_EQ(fixed(std::numeric_limits<double>::infinity(), 2), "inf");
    EXPECT_EQ(fixed(1e80, 2).size(), 81u + 7) << "falls back on six digits where its buffer ends";
}

TEST(Median, IsTheMiddleValue) {
    EXPECT_EQ(median(std::vector<double>{5, 1, 3}), 3);
    EXPECT_EQ(median(std::vector<int>{7}), 7);
}

TEST(Median, OfAnEvenNumberIsTheUpperOfTheTwoInTheMiddle) {
    EXPECT_EQ(median(std::vector<double>{4, 1, 3, 2}), 3);
    EXPECT_EQ(median(std::vector<int>{9, 2}), 9);
}

enum class Fruit { apple, pear, plum };
constexpr Names<Fruit, 2> kFruits{{{Fruit::apple, "apple"}, {Fruit::pear, "pear"}}};

TEST(NamesOfAnEnumeration, GoThereAndBack) {
    for (const auto& [fruit, name] : kFruits) {
        EXPECT_EQ(name_in(kFruits, fruit), name);
        EXPECT_EQ(value_in(kFruits, "fruit", name), fruit);
    }
}

TEST(NamesOfAnEnumeration, AValueThatHasNoneIsUnknown) { EXPECT_EQ(name_in(kFruits, Fruit::plum), "unknown"); }

TEST(NamesOfAnEnumeration, AnUnknownNameIsRefusedWithAllThatAreKnown) {
    EXPECT_EQ(test::error_of([] { (void)value_in(kFruits, "fruit", "plum"); }),
              "fruit = plum: must be one of apple, pear");
}

TEST(NamesOfAnEnumeration, MustBeWholeAndInTheSameCase) {
    for (const char* wrong : {"", "app", "apples", "Apple", " apple"}) {
        EXPECT_THAT(test::error_of([&] { (void)value_in(kFruits, "fruit", wrong); }), testing::HasSubstr("one of"));
    }
}

TEST(BadValue, SaysWhatValueWhereAndWhatIsAllowed) {
    EXPECT_STREQ(bad_value("step", "0", "positive", "job.json").what(), "step = 0 in job.json: must be positive");
    EXPECT_STREQ(bad_value("step", "0", "positive").what(), "step = 0: must be positive");
}

}  // namespace
}  // namespace raylign::detail
