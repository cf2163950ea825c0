#include "core/registration/trust/verdict.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string_view>

#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/registration/policy.h"
#include "core/registration/trust/view_agreement.h"

namespace raylign::detail {
namespace {

/// Of a whole's view. Right poses left at most 0.31 unexplained, 0.35 where the CT is cut at both ends; a spine whose
/// pixels were said to be a third too small ended 27 mm off with 0.48 and 0.40, and nothing else to doubt it.
constexpr double kWeakCost_whole = 0.4;
/// Of a part's view beside others: what overlies a bone in one direction leaves it clear in another. Right vertebrae of
/// a chest had views of up to 0.89.
constexpr double kUnseenCost_part = 0.9;
/// Of a part's views, the mean, less half of what the next place leaves more: the right place is far ahead, and of many
/// wrong ones the best is not. 177 of 200 right vertebrae of a chest have less; more have 26 of 50 wrong ones from
/// starts within the search's range, and 39 of 47 from starts that begin farther off (bench/README.md).
constexpr double kWeakMean_part = 0.715, kShareOfLead = 0.5, kLargestLead = 0.1;
constexpr double kWeakCost_found = 0.65;  // of a part that was found anywhere: of so many places some fit by chance
constexpr double kMostCovered = 0.7;      // of the image: little is left for other tissue to explain
constexpr double kOpposite = 1.2;         // worse than unrelated
constexpr double kTestedShift_mm = 60;    // how far starts without a search have been tested
constexpr double kTestedTurn_rad = 0.8;   // 45 degrees
constexpr double kRivalMargin = 0.015;    // of cost: the gap that noise can close
/// Around a result that explains nearly all, a rival that leaves twice as much is none, but for what noise closes.
constexpr double kRivalShare = 0.5, kRivalMargin_least = 0.002;
/// After a search everywhere: of so many places two fit alike by chance, and right poses have led by 0.13 and more.
constexpr double kRivalMargin_global = 0.05;
constexpr double kLeastOverlap_whole = 0.1;  // a CT may be much larger than the X-ray's field
constexpr double kLargestRim_mm = 1.5;       // an expected error above this is not a registration; of one view in plane
constexpr double kLargestRim_part_mm = 2;    // of a part among others
constexpr double kLargestRim_voxels = 0.5;   // of a coarse CT
constexpr std::string_view kUnsure = "the pose is poorly determined: ";
// A view of a whole whose wide edges are explained no better than this, and its fine ones, noise and all, not better
// than that: right poses of X-rays with scatter, noise and metal had at most 0.31 with less than 0.6, or 0.6 with 0.07.
constexpr double kHalfExplained = 0.25, kFineEdgesLost = 0.6;
// Of a whole that a descent found, weak signs: two of them are a doubt (bench/README.md, "Verdict").
constexpr double kPoorCost = 0.35;  // of a view
constexpr int kPoorAgreement = 1;   // of at least
constexpr int kLeastLooked = 5;     // starts around the result, so many or fewer ended there

void doubt_the_end(const RegistrationResult& result, std::vector<std::string>& reasons) {
    if (result.levels.empty()) return;
    const LevelReport& last = result.levels.back();
    if (last.termination != Termination::converged) {
        reasons.push_back("the finest level ended by " + std::string(termination_name(last.termination)) + " after " +
                          std::to_string(last.iterations) + " iterations");
    }
    if (std::isfinite(result.cost_initial) && !(result.cost_final <= result.cost_initial))
        reasons.push_back("the result's cost is not below the start's");
}

bool covers(const RegistrationResult& result, std::size_t view) {
    return view < result.covered.size() && result.covered[view] > kMostCovered;
}

double weak_cost(const RegistrationResult& result, std::size_t view) {
    if (result.content == Content::whole) return kWeakCost_whole;
    if (covers(result, view)) return kWeakCost;
    if (result.search.mode == Search::global) return kWeakCost_found;
    return result.view_costs.size() > 1 ? kUnseenCost_part : kWeakCost_part;
}

double mean_cost(const RegistrationResult& result) {
    const std::vector<double>& costs = result.view_costs;
    return std::accumulate(costs.begin(), costs.end(), 0.0) / static_cast<double>(costs.size());
}

/// By how much more the next place leaves unexplained than the result, where both were searched for.
double lead(const RegistrationResult& result) {
    const SearchReport& search = result.search;
    if (search.mode == Search::none) return 0;
    if (search.rivals.empty()) return search.agreeing > 0 ? kLargestLead : 0;  // 0: time was up
    return std::clamp(search.rivals.front().cost - search.cost, 0.0, kLargestLead);
}

/// Of a part's views taken together.
bool are_weak_together(const RegistrationResult& result) {
    return result.content == Content::part && result.view_costs.size() > 1 &&
           !(mean_cost(result) - kShareOfLead * lead(result) < kWeakMean_part);
}

void doubt_weak_views(const RegistrationResult& result, std::span<const View> views,
                      std::vector<std::string>& reasons) {
    bool is_told = false;
    for (std::size_t v = 0; v < result.view_costs.size(); ++v) {
        if (!is_weakly_explained(result, v)) continue;
        if (result.view_costs[v] < weak_cost(result, v)) {
            reasons.push_back("view " + views[v].name + " is explained poorly (cost " + fixed(result.view_costs[v], 2) +
                              "), its fine edges hardly (cost " + fixed(result.fine_view_costs[v], 2) + ")");
            continue;
        }
        std::string reason = "view " + views[v].name + " correlates weakly with its DRR (cost " +
                             fixed(result.view_costs[v], 2) + ", unrelated images have about 1)";
        if (result.view_costs[v] > kOpposite) reason += ": its contrast may be reversed (\"polarity\" in views.json)";
        if (result.content == Content::part && covers(result, v))
            reason += ", though the CT covers nearly all of it and should explain it";
        reasons.push_back(std::move(reason));
        is_told = true;
    }
    if (is_told || !are_weak_together(result)) return;
    reasons.push_back("the views correlate weakly with their DRRs (mean cost " + fixed(mean_cost(result), 2) +
                      ", unrelated images have about 1; the next place has " + fixed(lead(result), 2) + " more)");
}

/// A part whose centre lies beyond the places that were looked at was not compared with its neighbours.
void doubt_beyond_range(const RegistrationResult& result, const RigidTransform& start, const ObjectExtent& extent,
                        std::vector<std::string>& reasons) {
    if (result.content != Content::part || !(result.search.range_mm > 0)) return;
    const double shift_mm = (result.world_from_ct * extent.centre_ct_mm - start * extent.centre_ct_mm).norm();
    if (shift_mm <= result.search.range_mm) return;
    reasons.push_back("the result lies " + fixed(shift_mm, 1) + " mm from the start, beyond the " +
                      fixed(result.search.range_mm, 0) + " mm that were searched: a wider range may show a better one");
}

void doubt_little_overlap(const RegistrationResult& result, std::span<const View> views,
                          std::vector<std::string>& reasons) {
    const double least = result.content == Content::part ? kLeastSeen_part : kLeastOverlap_whole;
    for (std::size_t v = 0; v < result.overlap.size(); ++v) {
        if (result.overlap[v] >= least) continue;
        reasons.push_back("view " + views[v].name + " shows only " + fixed(100 * result.overlap[v], 0) +
                          " % of the object on usable pixels");
    }
}

std::string far_from_start(const RegistrationResult& result, const RigidTransform& start, const ObjectExtent& extent) {
    const RigidTransform moved = result.world_from_ct * inverse(start);
    const Eigen::Vector3d centre_mm = start * extent.centre_ct_mm;
    const double shift_mm = (moved * centre_mm - centre_mm).norm(), turn_rad = rotation_angle_rad(moved);
    if (shift_mm <= kTestedShift_mm && turn_rad <= kTestedTurn_rad) return {};
    return "the result is far from the start (" + fixed(shift_mm, 1) + " mm, " +
           fixed(turn_rad * 180 / std::numbers::pi, 1) + " deg): beyond the range in which the method has been tested";
}

std::string poorly_explained(const RegistrationResult& result, std::span<const View> views) {
    for (std::size_t v = 0; v < result.view_costs.size(); ++v) {
        if (result.view_costs[v] < kPoorCost) continue;
        return "view " + views[v].name + " is explained poorly (cost " + fixed(result.view_costs[v], 2) + ")";
    }
    return {};
}

std::string hardly_agreed(const RegistrationResult& result) {
    const SearchReport& around = result.search;
    if (around.refined < kLeastLooked || around.agreeing > kPoorAgreement) return {};
    return "of " + std::to_string(around.refined) + " starts around the result hardly one ended there";
}

/// Signs that each say little: two of them are a doubt. Where nobody has looked around, a far end alone is one.
void doubt_by_weak_signs(const RegistrationResult& result, std::span<const View> views, const RigidTransform& start,
                         const ObjectExtent& extent, std::vector<std::string>& reasons) {
    if (result.search.mode != Search::none) return;  // a search has looked around
    std::vector<std::string> signs{far_from_start(result, start, extent)};
    const bool looked_around = result.content == Content::whole && result.search.refined > 0;
    if (looked_around) {
        signs.push_back(poorly_explained(result, views));
        signs.push_back(hardly_agreed(result));
    }
    std::erase(signs, std::string());
    if (signs.size() >= (looked_around ? 2U : 1U)) reasons.push_back(joined(signs, "; "));
}

/// How far a rival has to be behind in cost.
double rival_margin(const RegistrationResult& result) {
    const SearchReport& search = result.search;
    if (search.mode == Search::none) return std::clamp(kRivalShare * search.cost, kRivalMargin_least, kRivalMargin);
    const bool anywhere = search.mode == Search::global && result.content == Content::part;
    return anywhere ? kRivalMargin_global : kRivalMargin;
}

void doubt_rivals(const RegistrationResult& result, std::vector<std::string>& reasons) {
    const bool searched = result.search.mode != Search::none;
    if (searched && result.search.agreeing == 1) {  // 0: time was up before they were compared
        // A minimum that one start found is as likely a chance one.
        reasons.push_back("only one of " + std::to_string(result.search.refined) + " refined starts ended here");
    }
    const double margin = rival_margin(result);
    for (const Rival& rival : result.search.rivals) {
        if (rival.cost - result.search.cost > margin) continue;
        reasons.push_back("a rival explains the X-rays nearly as well: " + fixed(rival.shift_mm, 1) + " mm and " +
                          fixed(rival.rotation_deg, 1) + " deg away, cost " + fixed(rival.cost, 4) + " against " +
                          fixed(result.search.cost, 4));
    }
}

void doubt_expected_error(const RegistrationResult& result, std::vector<std::string>& reasons) {
    const Confidence& confidence = result.confidence;
    const bool one_view = confidence.in_depth_mm > 0;
    const double error_mm = one_view ? confidence.in_plane_mm : confidence.rim_mm;
    const double voxel_mm = result.levels.empty() ? 0 : result.levels.back().spacing_mm.maxCoeff();
    const double largest_mm = result.content == Content::part ? kLargestRim_part_mm : kLargestRim_mm;
    if (error_mm <= std::max(largest_mm, kLargestRim_voxels * voxel_mm)) return;
    reasons.push_back(std::string(kUnsure) + "expected error " + fixed(error_mm, 1) + " mm" +
                      (one_view ? " in plane" : ""));
}

bool is_unsure(const std::string& reason) { return reason.starts_with(kUnsure); }

}  // namespace

bool is_weakly_explained(const RegistrationResult& result, std::size_t view) {
    const double cost = result.view_costs[view];
    if (!(cost < weak_cost(result, view))) return true;
    if (result.content != Content::whole || view >= result.fine_view_costs.size()) return false;
    return cost >= kHalfExplained && !(result.fine_view_costs[view] < kFineEdgesLost);
}

bool has_weak_view(const RegistrationResult& result) {
    for (std::size_t v = 0; v < result.view_costs.size(); ++v) {
        if (is_weakly_explained(result, v)) return true;
    }
    return are_weak_together(result);
}

std::vector<std::string> doubts(const RegistrationResult& result, std::span<const View> views,
                                const RigidTransform& start, const ObjectExtent& extent) {
    std::vector<std::string> reasons;
    doubt_the_end(result, reasons);
    doubt_weak_views(result, views, reasons);
    doubt_little_overlap(result, views, reasons);
    doubt_by_weak_signs(result, views, start, extent, reasons);
    doubt_beyond_range(result, start, extent, reasons);
    doubt_rivals(result, reasons);
    doubt_disagreeing_views(result, views, reasons);
    const bool is_unknown = !result.confidence.is_estimated && !result.confidence.is_withheld;
    if (result.method == Method::gauss_newton && std::isfinite(result.cost_initial) && is_unknown)
        reasons.push_back("the expected error could not be estimated: few pixels hold all that was compared");
    doubt_expected_error(result, reasons);
    return reasons;
}

void doubt_expected_error_anew(RegistrationResult& result) {
    std::erase_if(result.reasons, is_unsure);
    doubt_expected_error(result, result.reasons);
}

void doubt_beyond_the_cut(const RegistrationResult& result, std::vector<std::string>& reasons) {
    if (result.content != Content::whole || !(result.cost_final >= kPoorCost_cut)) return;
    reasons.push_back("what the cut CT should explain of the X-rays is explained poorly (cost " +
                      fixed(result.cost_final, 2) + "): it may fit better where it is cut differently");
}

void withhold_where_doubted(RegistrationResult& result) {
    if (result.ok || !result.confidence.is_estimated || std::ranges::all_of(result.reasons, is_unsure)) return;
    result.confidence = {};
    result.confidence.is_withheld = true;
}

}  // namespace raylign::detail
