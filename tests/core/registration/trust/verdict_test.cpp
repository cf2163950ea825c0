// One row per bound and side of core/registration/trust/verdict.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "core/registration/trust/verdict.h"

namespace raylign::detail {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
const ObjectExtent kJudgedExtent{.centre_ct_mm = {10, -20, 30}, .thickness_mm = 30, .radius_mm = 40};
const RigidTransform kJudgedStart = RigidTransform::translate({5, 6, 7});

/// All that is needed to be trusted: two views, the pose that it started from.
RegistrationResult trusted() {
    RegistrationResult result;
    result.world_from_ct = result.start_world_from_ct = kJudgedStart;
    result.method = Method::gauss_newton;
    result.cost_initial = 0.4;
    result.cost_final = 0.25;
    result.view_costs = {0.25, 0.25};
    result.overlap = {1, 1};
    result.covered = {0.5, 0.5};
    result.levels.resize(2);
    result.confidence.is_estimated = true;
    result.confidence.rim_mm = 0.1;
    return result;
}

struct VerdictCase {
    const char* name;
    std::function<void(RegistrationResult&)> change;
    const char* reason = nullptr;  ///< what the only reason says; none: the result is trusted
    const char* never = "\n";      ///< what no reason says
};
void PrintTo(const VerdictCase& row, std::ostream* out) { *out << row.name; }

template <class First, class Second>
auto both(First first, Second second) {
    return [=](RegistrationResult& r) {
        first(r);
        second(r);
    };
}

auto ended(Termination how, std::size_t level) {
    return [=](RegistrationResult& r) {
        r.levels[level].termination = how;
        r.levels[level].iterations = 7;
    };
}
auto costs(double initial, double final) {
    return [=](RegistrationResult& r) {
        r.cost_initial = initial;
        r.cost_final = final;
    };
}
auto second_view(double cost, Content content = Content::whole, Search search = Search::none, double covered = 0.5) {
    return [=](RegistrationResult& r) {
        r.view_costs[1] = cost;
        r.content = content;
        r.search.mode = search;
        r.covered[1] = covered;
    };
}
auto all_views(std::vector<double> costs, Content content) {
    return [=](RegistrationResult& r) {
        r.view_costs = costs;
        r.content = content;
    };
}
auto shown(double share, Content content) {
    return [=](RegistrationResult& r) {
        r.overlap[1] = share;
        r.content = content;
    };
}
/// Away from the start by a shift and a turn about the object's centre.
auto away(double shift_mm, double turn_rad, Content content = Content::whole, Search search = Search::none,
          double range_mm = 0) {
    return [=](RegistrationResult& r) {
        Twist turn = Twist::Zero();
        turn[1] = turn_rad;
        r.world_from_ct = RigidTransform::translate({0, 0, shift_mm}) *
                          exp_about(turn, kJudgedStart * kJudgedExtent.centre_ct_mm) * kJudgedStart;
        r.content = content;
        r.search.mode = search;
        r.search.range_mm = range_mm;
    };
}
auto agreeing(int count) {
    return [=](RegistrationResult& r) {
        r.search.mode = Search::near;
        r.search.refined = 12;
        r.search.agreeing = count;
    };
}
/// A second rival; the first is far behind. Costs that floats can hold.
auto rival(double behind, Content content = Content::whole, Search search = Search::near) {
    return [=](RegistrationResult& r) {
        r.content = content;
        r.search.mode = search;
        r.search.cost = 0.25;
        r.search.rivals = {{.cost = 0.75}, {.cost = 0.25 + behind, .shift_mm = 8.5, .rotation_deg = 4}};
    };
}
auto first_rival(double behind) {
    return both(rival(behind, Content::part),
                [](RegistrationResult& r) { std::swap(r.search.rivals[0], r.search.rivals[1]); });
}
auto sure(bool is_estimated, Method method, double cost_initial = 0.4) {
    return [=](RegistrationResult& r) {
        r.confidence = {.is_estimated = is_estimated};
        r.method = method;
        r.cost_initial = cost_initial;
    };
}
auto expected_error(double rim_mm) {
    return [=](RegistrationResult& r) { r.confidence.rim_mm = rim_mm; };
}

/// A descent's result that has been looked around, with a rival where its cost is given.
auto around(int refined, int agreeing, double rival_cost = 0, double cost = 0.25) {
    return [=](RegistrationResult& r) {
        r.search.refined = refined;
        r.search.agreeing = agreeing;
        r.search.cost = cost;
        if (rival_cost > 0) r.search.rivals = {{.cost = rival_cost}};
    };
}
auto fine_edges(double cost, double fine_cost) {
    return [=](RegistrationResult& r) {
        r.view_costs[1] = cost;
        r.fine_view_costs = {0.1, fine_cost};
    };
}
constexpr auto kWhole = Content::whole, kPart = Content::part;
constexpr const char *kWeak = "view LAT correlates weakly", *kReversed = "contrast may be reversed",
                     *kCovers = "the CT covers nearly all of it", *kFar = "far from the start",
                     *kBeyond = "beyond the 20 mm that were searched", *kRival = "8.5 mm and 4.0 deg away",
                     *kUnsure = "could not be estimated";

const VerdictCase kVerdicts[] = {
    {"AGoodResult", [](RegistrationResult&) {}},

    {"ACoarseLevelThatRanOut", ended(Termination::max_iterations, 0)},
    {"NoLevels", [](RegistrationResult& r) { r.levels.clear(); }},
    {"IterationsRanOut", ended(Termination::max_iterations, 1), "finest level ended by max-iterations after 7"},
    {"NonFiniteCost", ended(Termination::non_finite_cost, 1), "finest level ended by"},
    {"Stopped", ended(Termination::stopped, 1), "finest level ended by stopped"},
    {"TimeWasUp", ended(Termination::time_limit, 1), "finest level ended by"},

    {"TheStartsCost", costs(0.25, 0.25)},
    {"AboveTheStartsCost", costs(0.25, 0.2501), "cost is not below the start's"},
    {"NoFinalCost", costs(0.25, kNoNumber), "cost is not below the start's"},
    {"NoCostOfTheStart", costs(kNoNumber, 0.25)},

    {"WholeBelowWeak", second_view(0.3999)},
    {"WholeWeak", second_view(0.4), kWeak, kCovers},
    {"WholeWithoutCost", second_view(kNoNumber), kWeak},
    {"PartBelowUnseen", second_view(0.8999, kPart)},
    {"PartUnseen", second_view(0.9, kPart), kWeak, kCovers},
    {"PartNearBelowUnseen", second_view(0.8999, kPart, Search::near)},
    {"PartTogetherBelowWeak", all_views({0.6, 0.8299}, kPart)},
    {"PartTogetherWeak", all_views({0.6, 0.8301}, kPart), "the views correlate weakly", kWeak},
    {"PartTogetherFarAhead", both(first_rival(0.0401), all_views({0.65, 0.82}, kPart))},
    {"PartTogetherHardlyAhead", both(first_rival(0.0399), all_views({0.65, 0.82}, kPart)), "next place has 0.04 more"},
    {"PartTogetherWithoutRivals", both(agreeing(2), all_views({0.65, 0.8799}, kPart))},
    {"PartTogetherWeakWithoutRivals", both(agreeing(2), all_views({0.65, 0.8801}, kPart)),
     "the views correlate weakly"},
    {"PartTogetherWeakAndUnseen", all_views({0.6, 0.95}, kPart), kWeak, "the views correlate weakly"},
    {"PartInOneViewBelowWeak", all_views({0.7999}, kPart)},
    {"PartInOneViewWeak", all_views({0.8}, kPart), "view AP correlates weakly"},
    {"PartWithoutCosts", all_views({0.5, kNoNumber}, kPart), kWeak, "the views correlate weakly"},
    {"PartFoundBelowWeak", second_view(0.6499, kPart, Search::global)},
    {"PartFoundWeak", second_view(0.65, kPart, Search::global), kWeak, kCovers},
    {"WholeFoundBelowWeak", second_view(0.3999, kWhole, Search::global)},
    {"PartThatCoversLittle", second_view(0.8999, kPart, Search::none, 0.7)},
    {"PartThatCoversBelowWeak", second_view(0.4999, kPart, Search::none, 0.7001)},
    {"PartThatCoversWeak", second_view(0.5, kPart, Search::none, 0.7001), kCovers},
    {"Unrelated", second_view(1.2), kWeak, kReversed},
    {"WorseThanUnrelated", second_view(1.2001), kReversed},

    {"WholeBarelyShown", shown(0.1, kWhole)},
    {"WholeHardlyShown", shown(0.0999, kWhole), "view LAT shows only 10 %"},
    {"WholeOfUnknownShare", shown(kNoNumber, kWhole), "view LAT shows only"},
    {"PartHalfShown", shown(0.5, kPart)},
    {"PartBelowHalf", shown(0.4951, kPart), "view LAT shows only 50 %"},

    {"ShiftedAsTested", away(59.999, 0)},
    {"ShiftedFarther", away(60.001, 0), kFar},
    {"TurnedAsTested", away(0, 0.7999)},
    {"TurnedFarther", away(0, 0.8001), kFar},
    {"FarAfterASearch", away(300, 2, kWhole, Search::near, 20)},
    {"NowhereAtAll", away(kNoNumber, 0), kFar},

    {"PartWithinTheRange", away(19.999, 0, kPart, Search::near, 20)},
    {"PartBeyondTheRange", away(20.001, 0, kPart, Search::near, 20), kBeyond},
    {"PartTurnedAtItsPlace", away(0, 1, kPart, Search::near, 20)},
    {"PartFoundFarAway", away(90, 0, kPart, Search::global, 0)},

    {"FarButBeyondDoubt", both(away(90, 0), around(9, 9))},
    {"FarAndHardlyAgreed", both(away(90, 0), around(9, 1)), kFar},
    {"HardlyAgreedAlone", around(9, 1)},
    {"FewLookedAround", both(away(90, 0), around(4, 1))},
    {"PoorlyExplainedAlone", both(second_view(0.3999), around(9, 9))},
    {"PoorlyExplainedAndHardlyAgreed", both(second_view(0.35), around(9, 0)), "view LAT is explained poorly"},
    {"FineEdgesLost", fine_edges(0.3, 0.61), "its fine edges hardly"},
    {"FineEdgesLeft", fine_edges(0.3, 0.59)},
    {"FineEdgesLostInNoise", fine_edges(0.2, 0.8)},
    {"RivalOfAPerfectResult", around(9, 9, 0.0041, 0.002)},
    {"RivalNearAPerfectResult", around(9, 9, 0.0039, 0.002), "0.0 mm and 0.0 deg away"},

    {"AgreementUnknown", agreeing(0)},
    {"NoAgreement", agreeing(1), "only one of 12 refined starts"},
    {"Agreement", agreeing(2)},

    {"RivalBehind", rival(0.0151)},
    {"RivalClose", rival(0.0149), kRival},
    {"RivalAhead", rival(-0.1), kRival},
    {"RivalOfAPartBehind", rival(0.0151, kPart)},
    {"RivalOfAPartClose", rival(0.0149, kPart), kRival},
    {"RivalAnywhereBehind", rival(0.0501, kPart, Search::global)},
    {"RivalAnywhereClose", rival(0.0499, kPart, Search::global), kRival},
    {"RivalOfAWholeAnywhereBehind", rival(0.0151, kWhole, Search::global)},
    {"RivalWithoutCost", rival(kNoNumber), kRival},

    {"NoConfidence", sure(false, Method::gauss_newton), kUnsure},
    {"NoConfidenceFromDescent", sure(false, Method::steepest_descent)},
    {"NoConfidenceAsTimeWasUp", sure(false, Method::gauss_newton, kNoNumber)},
    {"ErrorOfARegistration", expected_error(1.5)},
    {"ErrorOfNone", expected_error(1.5001), "poorly determined"},
    {"ErrorOfAPart", both(second_view(0.2, kPart), expected_error(2))},
    {"ErrorOfNoPart", both(second_view(0.2, kPart), expected_error(2.0001)), "poorly determined"},
    {"ErrorOfACoarseCt",
     [](RegistrationResult& r) {
         r.confidence.rim_mm = 2.4;
         r.levels.back().spacing_mm = {2, 5, 2};
     }},
    {"DepthOfOneView",
     [](RegistrationResult& r) {
         r.confidence.rim_mm = r.confidence.in_depth_mm = 4;
         r.confidence.in_plane_mm = 0.2;
     }},
    {"OneViewUnsureInPlane",
     [](RegistrationResult& r) {
         r.confidence.rim_mm = r.confidence.in_depth_mm = 4;
         r.confidence.in_plane_mm = 1.6;
     },
     "1.6 mm in plane"},
    {"ErrorThatIsNoNumber", expected_error(kNoNumber), "poorly determined"},
};

class Verdict : public testing::TestWithParam<VerdictCase> {};

TEST_P(Verdict, GivesTheReasonsOfTheTable) {
    const std::vector<View> views = {{"AP", {}, {}, {}}, {"LAT", {}, {}, {}}};
    RegistrationResult result = trusted();
    GetParam().change(result);
    const std::vector<std::string> reasons = doubts(result, views, kJudgedStart, kJudgedExtent);
    if (GetParam().reason == nullptr) {
        EXPECT_THAT(reasons, testing::IsEmpty());
    } else {
        EXPECT_THAT(reasons, testing::ElementsAre(testing::AllOf(testing::HasSubstr(GetParam().reason),
                                                                 testing::Not(testing::HasSubstr(GetParam().never)))));
    }
}
INSTANTIATE_TEST_SUITE_P(Of, Verdict, testing::ValuesIn(kVerdicts), [](const auto& row) { return row.param.name; });

TEST(VerdictOfCutCts, DoubtsACostThatLeavingOutWhatIsHiddenCannotExcuse) {
    RegistrationResult result = trusted();
    std::vector<std::string> reasons;
    result.cost_final = 0.44;
    doubt_beyond_the_cut(result, reasons);
    EXPECT_THAT(reasons, testing::IsEmpty());
    result.cost_final = 0.45;
    doubt_beyond_the_cut(result, reasons);
    EXPECT_THAT(reasons, testing::ElementsAre(testing::HasSubstr("the cut CT")));
    result.content = Content::part;  // other tissue is expected around it
    doubt_beyond_the_cut(result, reasons);
    EXPECT_THAT(reasons, testing::SizeIs(1));
}

TEST(VerdictOfMany, NamesEveryReason) {
    RegistrationResult result = trusted();
    ended(Termination::max_iterations, 1)(result);
    shown(0.05, kWhole)(result);
    expected_error(9)(result);
    const std::vector<View> views = {{"AP", {}, {}, {}}, {"LAT", {}, {}, {}}};
    EXPECT_EQ(doubts(result, views, kJudgedStart, kJudgedExtent).size(), 3u);
}

}  // namespace
}  // namespace raylign::detail
