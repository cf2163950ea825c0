#include "core/registration/verdict.h"

#include <cmath>
#include <numbers>

#include "core/registration/number_text.h"

namespace raylign {
namespace {

constexpr double kWeakCost_whole = 0.5;  // a mean correlation below one half: the DRR explains too little
constexpr double kWeakCost_part = 0.8;   // other tissue is expected, but this is what unrelated edges reach
constexpr double kTestedShift_mm = 60;   // how far starts without a search have been tested
constexpr double kTestedTurn_rad = 0.8;  // 45 degrees
constexpr double kRivalMargin = 0.015;   // of cost: the gap that noise can close
/// After a search everywhere: of so many places two fit alike by chance, and right poses have led by 0.13 and more.
constexpr double kRivalMargin_global = 0.05;
constexpr int kFewestAgreeing = 2;           // a minimum that one start found is as likely a chance one
constexpr double kLeastOverlap_part = 0.5;   // what a search asks for, too
constexpr double kLeastOverlap_whole = 0.1;  // a CT may be much larger than the X-ray's field
constexpr double kLargestRim_mm = 1.5;       // an expected error above this is not a registration

void doubt_the_end(const RegistrationResult& result, std::vector<std::string>& reasons) {
    if (result.levels.empty()) return;
    const LevelReport& last = result.levels.back();
    if (last.termination != Termination::converged) {
        reasons.push_back("the finest level ended by " + std::string(termination_name(last.termination)) + " after " +
                          std::to_string(last.iterations) + " iterations");
    }
    if (!(result.cost_final <= result.cost_initial)) reasons.push_back("the result's cost is not below the start's");
}

void doubt_weak_views(const RegistrationResult& result, std::span<const View> views,
                      std::vector<std::string>& reasons) {
    const double limit = result.content == Content::part ? kWeakCost_part : kWeakCost_whole;
    for (std::size_t v = 0; v < result.view_costs.size(); ++v) {
        if (result.view_costs[v] < limit) continue;
        reasons.push_back("view " + views[v].name + " correlates weakly with its DRR (cost " +
                          fixed(result.view_costs[v], 2) + ", unrelated images have about 1)");
    }
}

void doubt_little_overlap(const RegistrationResult& result, std::span<const View> views,
                          std::vector<std::string>& reasons) {
    const double least = result.content == Content::part ? kLeastOverlap_part : kLeastOverlap_whole;
    for (std::size_t v = 0; v < result.overlap.size(); ++v) {
        if (result.overlap[v] >= least) continue;
        reasons.push_back("view " + views[v].name + " shows only " + fixed(100 * result.overlap[v], 0) +
                          " % of the object on usable pixels");
    }
}

void doubt_far_ends(const RegistrationResult& result, const RigidTransform& start, const ObjectExtent& extent,
                    std::vector<std::string>& reasons) {
    if (result.search.mode != Search::none) return;  // a search has looked around
    const RigidTransform moved = result.world_from_ct * inverse(start);
    const Eigen::Vector3d centre_mm = start * extent.centre_ct_mm;
    const double shift_mm = (moved * centre_mm - centre_mm).norm(), turn_rad = rotation_angle_rad(moved);
    if (shift_mm <= kTestedShift_mm && turn_rad <= kTestedTurn_rad) return;
    reasons.push_back("the result is far from the start (" + fixed(shift_mm, 1) + " mm, " +
                      fixed(turn_rad * 180 / std::numbers::pi, 1) +
                      " deg): beyond the range in which the method has been tested");
}

void doubt_rivals(const RegistrationResult& result, std::vector<std::string>& reasons) {
    if (result.search.starts > 1 && result.search.agreeing < kFewestAgreeing) {
        reasons.push_back("only one of " + std::to_string(result.search.refined) + " refined starts ended here");
    }
    const bool anywhere = result.search.mode == Search::global && result.content == Content::part;
    for (const Rival& rival : result.search.rivals) {
        if (rival.cost - result.search.cost > (anywhere ? kRivalMargin_global : kRivalMargin)) continue;
        reasons.push_back("a rival explains the X-rays nearly as well: " + fixed(rival.shift_mm, 1) + " mm and " +
                          fixed(rival.rotation_deg, 1) + " deg away, cost " + fixed(rival.cost, 4) + " against " +
                          fixed(result.search.cost, 4));
    }
}

}  // namespace

std::vector<std::string> doubts(const RegistrationResult& result, std::span<const View> views,
                                const RigidTransform& start, const ObjectExtent& extent) {
    std::vector<std::string> reasons;
    doubt_the_end(result, reasons);
    doubt_weak_views(result, views, reasons);
    doubt_little_overlap(result, views, reasons);
    doubt_far_ends(result, start, extent, reasons);
    doubt_rivals(result, reasons);
    if (result.confidence.rim_mm > kLargestRim_mm) {
        reasons.push_back("the pose is poorly determined: expected error " + fixed(result.confidence.rim_mm, 1) +
                          " mm");
    }
    return reasons;
}

}  // namespace raylign
