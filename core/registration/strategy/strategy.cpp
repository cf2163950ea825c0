#include "core/registration/strategy/strategy.h"

#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/registration/policy.h"
#include "core/registration/strategy/descent.h"
#include "core/registration/strategy/part_search.h"
#include "core/registration/strategy/reversed_contrast.h"
#include "core/registration/strategy/rivals.h"
#include "core/registration/strategy/whole_search.h"

namespace raylign::detail {
namespace {

void choose_method(Run& run) {
    RegistrationResult& result = run.result;
    result.method = run.options.method;
    if (result.method != Method::automatic) return;
    const bool derivatives = run.has_derivatives();
    result.method = derivatives ? Method::gauss_newton : Method::steepest_descent;
    result.method_reason = derivatives ? "the fewest evaluations: the backend gives analytic derivatives"
                                       : "the backend gives no derivatives";
}

/// A part is sought around its start where nothing else is asked for: other edges lead a descent astray.
Search search_for(const Run& run, Content content) {
    const Search wanted = run.options.search.mode;
    if (wanted != Search::automatic) return wanted;
    return content == Content::part && run.has_derivatives() ? Search::near : Search::none;
}

/// The result is `whole` again; what the backend did since counts.
void go_back_to(Run& run, const RegistrationResult& whole, const std::string& decision) {
    const SessionTiming timing = run.result.timing;
    const SessionCounters counters = run.result.counters;
    run.result = whole;
    run.result.timing = timing;
    run.result.counters = counters;
    if (!decision.empty()) run.result.decisions.push_back(decision);
}

double unexplained(const Run& run) { return run.explained_cost.value_or(run.result.cost_final); }

/// Looks around what a descent found, and goes on from there where another pose explains the X-rays better. A stop
/// leaves the result that was there.
void look_around(Run& run) {
    if (!run.options.look_around || run.result.method != Method::gauss_newton || !run.explained_cost ||
        *run.explained_cost >= kWeakCost)
        return;
    const double found_cost = *run.explained_cost;
    const std::vector<double> found_view_costs = run.explained_view_costs;
    RegistrationResult found = run.result;
    const auto back_to_found = [&](const std::string& decision) {
        go_back_to(run, found, decision);
        run.explained_cost = found_cost;
        run.explained_view_costs = found_view_costs;
    };
    try {
        const std::optional<RigidTransform> again = from_the_start_again(run);
        const std::optional<RigidTransform> better = again ? again : look_for_rivals(run);
        if (!better) return;
        found.search = run.result.search;
        run.result.decisions.emplace_back(
            "went on from another pose that explains the X-rays better on a coarse level");
        run.result.world_from_ct = *better;
        run.explained_cost.reset();
        if (!again) run.shows_the_cut.reset();
        descend(run, Content::whole, StartCheck::none, again ? 1 : 0);
        if (run.explained_cost && *run.explained_cost < found_cost) {
            (void)look_for_rivals(run);
            return;
        }
        std::erase_if(found.search.rivals, [&](const Rival& rival) { return rival.cost < found.search.cost; });
        back_to_found(
            "another pose that explains the X-rays better on a coarse level explains them worse on finer ones");
    } catch (const RunStopped&) {
        back_to_found("");
    }
}

constexpr double kFarResult = 0.75;  // of the search's range, from the start

/// From the start that was searched around to the result: of the object's centre.
double from_start_mm(const Run& run) {
    const Eigen::Vector3d& centre_ct_mm = run.extent.centre_ct_mm;
    return (run.result.world_from_ct * centre_ct_mm - run.start * centre_ct_mm).norm();
}

/// The best place near the border of what was searched may be a neighbour of the right one beyond: searched for once
/// more, around the result. The better one stays; whether it lies beyond the range that was asked for is judged as
/// ever. A range below the default is a wish to stay near. A stop leaves the result that was there.
void search_around_far_result(Run& run) {
    const double range_mm = run.result.search.range_mm;
    const double far_mm = from_start_mm(run);
    if (range_mm < kNearRange_mm || run.is_hopeless || !(far_mm > kFarResult * range_mm)) return;
    const RegistrationResult first = run.result;
    const RigidTransform start = std::exchange(run.start, first.world_from_ct);
    const auto first_explained = run.explained_cost;
    const auto first_view_costs = run.explained_view_costs;
    const auto back_to_first = [&](const std::string& decision) {
        go_back_to(run, first, decision);
        run.explained_cost = first_explained;
        run.explained_view_costs = first_view_costs;
    };
    const auto looked_at =
        "looked once more around the result, which lies " + fixed(far_mm, 0) + " mm from the start: ";
    try {
        search_part(run, Search::near);
        const bool is_better = run.result.cost_final < first.cost_final;
        if (is_better) run.result.decisions.push_back(looked_at + "a better place was found");
        if (!is_better) back_to_first(looked_at + "no better place was found");
        run.result.cost_initial = first.cost_initial;
    } catch (const RunStopped&) {
        back_to_first("");
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        back_to_first("");
    }
    run.start = start;
}

void find_pose_as(Run& run, Content content, StartCheck check) {
    const Search search = search_for(run, content);
    run.result.content = content;
    if (search == Search::none) {
        descend(run, content, check);
        if (content == Content::whole) look_around(run);
    } else if (content == Content::whole) {
        search_whole(run, search, check);
    } else {
        search_part(run, search);
        if (search == Search::near) search_around_far_result(run);
    }
}

/// Second try, where the volume as a whole explains too little. Where that comes to no end, a finished whole stays.
void try_as_part(Run& run) {
    const RegistrationResult whole = run.result;
    const bool is_finished = run.explained_cost.has_value();
    const std::string weak = "as a whole it correlates weakly (cost " + std::to_string(unexplained(run)) +
                             ", at most " + fixed(kWeakCost, 1) + " for a whole)";
    run.result.decisions.push_back("registered as part of what the X-ray shows: " + weak);
    run.result.world_from_ct = run.start;
    run.result.search = {};
    run.result.confidence = {};
    try {
        find_pose_as(run, Content::part, StartCheck::none);
    } catch (const RunStopped& stopped) {
        if (is_finished) {
            const std::string why =
                stopped.why == Termination::time_limit ? "the time limit was over" : "the caller stopped the run";
            go_back_to(run, whole, why + " before it was registered as a part, too: " + weak);
        }
        throw;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        if (!is_finished) throw Error(weak + "; as a part: " + error.what());
        go_back_to(run, whole, weak + "; as a part: " + error.what());
    }
}

}  // namespace

void find_pose(Run& run) {
    choose_method(run);
    run.result.world_from_ct = run.start;
    const Content wanted = run.options.content;
    find_pose_as(run, wanted == Content::part ? Content::part : Content::whole, StartCheck::overlap);
    if (wanted != Content::automatic || unexplained(run) < kWeakCost) return;
    if (run.options.suspect_mirrored) run.suspicion = reversed_contrast(run);
    if (!run.suspicion) try_as_part(run);
}

}  // namespace raylign::detail
