#include <gtest/gtest.h>

#include "apps/shared/options.h"
#include "apps/shared/progress_bar.h"
#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

TEST(ParseTriple, TakesOneOrThreeNumbers) {
    EXPECT_EQ(parse_triple("1,2.5,-3", "--x"), Eigen::Vector3d(1, 2.5, -3));
    EXPECT_EQ(parse_triple("64", "--x"), Eigen::Vector3d(64, 64, 64));
}

TEST(ParseTriple, NamesTheOptionThatIsWrong) {
    for (const char* text : {"", "1,2", "1,2,3,4", "1,,2", "a", "1,2,3 ", ",1,2"}) {
        EXPECT_THROW((void)parse_triple(text, "--size"), Error) << text;
    }
}

TEST(EngineFlags, OptionsOfGpusAreRefusedWhereTheyMeanNothing) {
    const auto settle = [](const EngineFlags& engine) {
        DrrOptions options;
        options.engine = engine;
        settle_conflicts(options);
    };
    EXPECT_NO_THROW(settle({.backend = "gl", .storage = "int16", .interpolation = "exact", .crop = true}));
    EXPECT_NO_THROW(settle({.backend = "gl-2006", .slices = "object-aligned", .reduction = "mipmap-half"}));
    EXPECT_NO_THROW(settle({.backend = "cpu", .interpolation = "exact"})) << "which it is";
    EXPECT_THROW(settle({.backend = "cpu", .interpolation = "hardware"}), Error);
    EXPECT_THROW(settle({.backend = "reference", .crop = true}), Error);
    EXPECT_THROW(settle({.backend = "gl", .reduction = "mipmap"}), Error);
    EXPECT_THROW(settle({.backend = "gl-2006", .reduction = "guess"}), Error);
    EXPECT_THROW(settle({.backend = "gl", .interpolation = "cubic"}), Error);
    EXPECT_THROW(settle({.backend = "gl", .storage = "float16"}), Error);
}

TEST(QuoteForShell, QuotesOnlyWhatNeedsIt) {
    EXPECT_EQ(quote_for_shell({"raylign", "-v", "ct.nii.gz"}), "raylign -v ct.nii.gz");
    EXPECT_EQ(quote_for_shell({"a b", "", "it's", "$HOME"}), "'a b' '' 'it'\\''s' '$HOME'");
}

TEST(ProgressLine, ShowsLevelCostAndTimeLeft) {
    EXPECT_EQ(
        progress_line({.level = 1, .levels = 4, .iteration = 7, .cost = 0.12345, .fraction = 0.5, .remaining_s = 2.2}),
        "[############------------]  50%  level 2/4  cost 0.1235  3 s left");
}

TEST(ProgressLine, StaysWithinItsBarForBadEstimates) {
    EXPECT_EQ(progress_line({.fraction = 7, .remaining_s = -1}),
              "[########################] 100%  level 1/1  cost 0.0000  0 s left");
}

}  // namespace
}  // namespace raylign::detail::apps
