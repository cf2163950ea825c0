#include <gtest/gtest.h>

#include "apps/shared/invocation.h"
#include "apps/shared/lines.h"
#include "apps/shared/options.h"
#include "apps/shared/parse.h"
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

TEST(BackendFlags, OptionsOfGpusAreRefusedWhereTheyMeanNothing) {
    const auto settle = [](const BackendFlags& flags) { settle_conflicts(flags); };
    EXPECT_NO_THROW(settle({.name = "gl", .storage = "int16", .interpolation = "exact", .crop = true}));
    EXPECT_NO_THROW(settle({.name = "gl-2006", .slices = "object-aligned", .reduction = "mipmap-half"}));
    EXPECT_NO_THROW(settle({.name = "cpu", .interpolation = "exact"})) << "which it is";
    EXPECT_THROW(settle({.name = "cpu", .interpolation = "hardware"}), Error);
    EXPECT_THROW(settle({.name = "reference", .crop = true}), Error);
    EXPECT_THROW(settle({.name = "gl", .reduction = "mipmap"}), Error);
    EXPECT_THROW(settle({.name = "gl-2006", .reduction = "guess"}), Error);
    EXPECT_THROW(settle({.name = "gl", .interpolation = "cubic"}), Error);
    EXPECT_THROW(settle({.name = "gl", .storage = "float16"}), Error);
    EXPECT_NO_THROW(settle({.name = "gl", .solver = "device"}));
    EXPECT_NO_THROW(settle({.name = "cpu", .solver = "host"})) << "which it is";
    EXPECT_THROW(settle({.name = "cpu", .solver = "device"}), Error);
    EXPECT_THROW(settle({.name = "gl-2006", .solver = "device"}), Error);
    EXPECT_THROW(settle({.name = "gl", .solver = "nobody"}), Error);
}

TEST(BackendFlags, ThreadsAreForEveryBackendThatHasAny) {
    const BackendOptions three = backend_options({.threads = 3}), all = backend_options({});
    EXPECT_EQ(three.cpu.threads, 3);
    EXPECT_EQ(three.gl.threads, 3);
    EXPECT_EQ(three.gl_2006.threads, 3);
    for (const auto& threads : {all.cpu.threads, all.gl.threads, all.gl_2006.threads}) EXPECT_FALSE(threads);
}

TEST(ParseList, TrimsBlanksAndRefusesWhatIsEmptyOrTwice) {
    EXPECT_EQ(parse_list("cpu, gl ,reference", "--backend"), (std::vector<std::string>{"cpu", "gl", "reference"}));
    for (const char* text : {"", "a,", ",a", "a,,b", " ", "a, a"}) {
        EXPECT_THROW((void)parse_list(text, "--backend"), Error) << text;
    }
}

TEST(SplitNamed, NeedsANameAndAValue) {
    EXPECT_EQ(split_named("AP=a=b.csv", "--landmarks"), std::pair(std::string("AP"), std::string("a=b.csv")));
    for (const char* text : {"", "AP", "AP=", "=a.csv"}) EXPECT_THROW((void)split_named(text, "--x"), Error) << text;
}

TEST(MethodAndSearch, SearchesThatWouldBeIgnoredAreRefused) {
    EXPECT_NO_THROW(settle_conflicts(SearchFlags{.mode = "near", .range_mm = 5}, MethodFlags{}));
    EXPECT_THROW(settle_conflicts(SearchFlags{.mode = "none", .starts = 5}, MethodFlags{}), Error);
    EXPECT_THROW(settle_conflicts(SearchFlags{.mode = "global", .range_mm = 5}, MethodFlags{}), Error);
    EXPECT_THROW(settle_conflicts(SearchFlags{.mode = "near"}, MethodFlags{.name = "bobyqa"}), Error);
}

TEST(Line, PutsTheTextAfterTheLabelsColumn) {
    EXPECT_EQ(line("cost", "0.5"), "  cost      0.5\n");
    EXPECT_EQ(format("%s %zu", std::string(400, 'a').c_str(), std::size_t{7}), std::string(400, 'a') + " 7");
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
