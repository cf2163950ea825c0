#include "core/registration/strategy/driver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "core/base/error.h"
#include "core/registration/trust/confidence.h"
#include "core/registration/level/pixel_weights.h"

namespace raylign {
namespace {

constexpr double kInitialStep_px = 2;       // on the coarsest level; finer ones start where the coarser one ended
constexpr double kWeakCost = 0.5;           // a mean correlation below one half: the volume explains too little
constexpr double kHopelessCost = 0.7;       // on the coarsest level, where noise is averaged away
constexpr double kRobustFrom_cost = 0.005;  // below, noise is all that is left: weights would only cost time
constexpr int kRobustRounds = 3;
constexpr double kRobustSettled_px = 0.02;  // a renewal that moves the object's rim less is the last
constexpr double kFineFilterShare = 0.25;   // of the filter's width: a bone's fine edges are its own, wide ones are not
constexpr double kLeastSigma_px = 0.5;

}  // namespace

void Driver::solve() {
    choose_method();
    const Content content = run_.options.content == Content::part ? Content::part : Content::whole;
    const Search search = run_.options.search.mode;
    if (search == Search::near || search == Search::global) {
        content == Content::part ? search_part(search) : search_whole(search);
    } else if (content == Content::part && search == Search::automatic && has_derivatives_) {
        search_part(Search::near);
    } else {
        pyramid(content);
    }
    if (run_.options.content == Content::automatic && !(explained_cost_.value_or(result_.cost_final) < kWeakCost))
        try_as_part();
}

void Driver::choose_method() {
    result_.world_from_ct = run_.start;
    result_.method = run_.options.method;
    if (result_.method != Method::automatic) return;
    if (!has_derivatives_) {
        result_.method = Method::steepest_descent;
        result_.method_reason = "the engine gives no derivatives";
        return;
    }
    result_.method = Method::gauss_newton;
    result_.method_reason = "the fewest evaluations: the engine gives analytic derivatives";
}

void Driver::try_as_part() {
    const RegistrationResult whole = result_;
    const bool is_finished = explained_cost_.has_value();
    const std::string weak = "as a whole it correlates weakly (cost " +
                             std::to_string(explained_cost_.value_or(whole.cost_final)) + ", at most 0.5 for a whole)";
    result_.decisions.push_back("registered as part of what the X-ray shows: " + weak);
    result_.world_from_ct = run_.start;
    result_.search = {};
    result_.confidence = {};
    try {
        solve_part();
    } catch (const TimeIsUp&) {
        if (is_finished) go_back_to(whole, "the time limit was over before it was registered as a part, too: " + weak);
        throw;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        if (!is_finished) throw Error(weak + "; as a part: " + error.what());
        go_back_to(whole, weak + "; as a part: " + error.what());
    }
}

void Driver::go_back_to(const RegistrationResult& whole, const std::string& decision) {
    const SessionTiming timing = result_.timing;
    const SessionCounters counters = result_.counters;
    result_ = whole;
    result_.timing = timing;
    result_.counters = counters;
    result_.decisions.push_back(decision);
}

void Driver::solve_part() {
    const Search wanted = run_.options.search.mode;
    if (wanted == Search::none || !has_derivatives_) {
        pyramid(Content::part);
    } else {
        search_part(wanted == Search::automatic ? Search::near : wanted);
    }
}

GradientFilter Driver::filter_of(bool fine) const {
    GradientFilter filter = run_.options.similarity.filter;
    if (fine) {
        filter.sigma_px = std::max(kLeastSigma_px, filter.sigma_px * kFineFilterShare);
        filter.radius_px = std::max(2, static_cast<int>(std::ceil(3 * filter.sigma_px)));
    }
    return filter;
}

std::vector<LevelPlan> Driver::plan(Content content) {
    const GradientFilter filter = filter_of(content == Content::part);
    std::vector<LevelPlan> levels =
        plan_levels(run_.volume, run_.views, run_.start, run_.extent, filter, run_.options.levels);
    run_.total_work = run_.done_work;
    for (const LevelPlan& level : levels) run_.total_work += level_work(level);
    run_.level_count = run_.levels_made + static_cast<int>(levels.size());
    return levels;
}

void Driver::pyramid(Content content) {
    result_.content = content;
    const std::vector<LevelPlan> levels = plan(content);
    double step_mm = kInitialStep_px * levels.front().pixel_at_object_mm;
    std::unique_ptr<Level> coarser;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        std::optional<Focus> focus;
        if (content == Content::part) focus = {result_.world_from_ct, kDomainMargin_mm};
        auto level = std::make_unique<Level>(run_, levels[i], content, focus);
        if (run_.levels_made == 1) level->check_overlap();
        if (content == Content::part) {
            level->session().set_weights(part_weights(*level, result_.world_from_ct, kDomainMargin_mm));
        }
        take_the_better_start(*level, i > 0);
        const LevelOutcome found = level->optimize(result_.world_from_ct, i + 1 == levels.size(), step_mm);
        step_mm = std::clamp(found.last_step_mm, levels[i].pixel_at_object_mm / 8,
                             kInitialStep_px * levels[i].pixel_at_object_mm);
        run_.done_work += level_work(levels[i]);
        result_.cost_final = found.cost;
        if (found.termination == Termination::non_finite_cost) {
            result_.cost_final = std::numeric_limits<double>::quiet_NaN();
            return;
        }
        if (is_hopeless(levels.size(), i, found.cost)) return;
        if (i + 1 == levels.size()) finish_as_it_needs(*level, coarser.get());
        coarser = std::move(level);
    }
}

bool Driver::is_hopeless(std::size_t levels, std::size_t i, double cost) const {
    return run_.options.content == Content::automatic && result_.content == Content::whole && i == 0 && levels > 1 &&
           cost > kHopelessCost;
}

void Driver::take_the_better_start(Level& level, bool has_coarser) {
    const std::array poses{result_.world_from_ct, run_.start};
    std::array<double, 2> costs{};
    level.session().evaluate(poses, costs);
    level.report().restarted = has_coarser && costs[1] < costs[0];
    if (level.report().restarted) result_.world_from_ct = run_.start;
    level.report().cost_initial = costs[level.report().restarted ? 1 : 0];
}

std::vector<Image> Driver::part_weights(Level& level, const RigidTransform& centre, double margin_mm) const {
    const double px = 1 / level.plan().pixel_at_object_mm;
    std::vector<Image> base = neighbourhood(
        level.session(), centre, static_cast<int>(std::ceil(margin_mm * px)) + level.plan().filter.radius_px);
    multiply(base, local_normalisation(level.session(), kNormalisation_mm * px));
    return base;
}

void Driver::finish_as_it_needs(Level& level, Level* coarser) {
    explained_cost_ = level.report().cost_final;
    const bool explains_all = result_.content == Content::part || !is_robust(level);
    if (explains_all || run_.options.similarity.metric != Metric::gc) {
        finish(level, coarser);
        return;
    }
    result_.decisions.push_back(
        "finished with a fine filter and evened-out gradients: the DRR leaves a part of the X-ray unexplained "
        "(cost " +
        std::to_string(level.report().cost_final) + ")");
    LevelPlan plan = level.plan();
    plan.filter = filter_of(true);
    ++run_.level_count;
    Level fine(run_, plan, result_.content);
    fine.session().set_weights(local_normalisation(fine.session(), kNormalisation_mm / plan.pixel_at_object_mm));
    fine.report().cost_initial = fine.cost(result_.world_from_ct);
    fine.optimize(result_.world_from_ct, true, plan.pixel_at_object_mm);
    finish(fine, nullptr);
}

void Driver::finish(Level& level, Level* coarser) {
    make_robust(level);
    Session& session = level.session();
    result_.cost_initial = level.cost(run_.start);
    const std::vector<MomentSums> sums = session.moment_sums({&result_.world_from_ct, 1});
    const auto channels = static_cast<std::size_t>(session.channel_count());
    result_.view_costs.clear();
    for (std::size_t v = 0; v < session.view_count(); ++v) {
        result_.view_costs.push_back(view_cost({sums.data() + v * channels, channels}));
    }
    result_.cost_final = level.report().cost_final = level.cost(result_.world_from_ct);
    if (result_.method == Method::gauss_newton) {
        Level& used = coarser ? *coarser : level;
        result_.confidence = jackknife(used.problem(result_.world_from_ct, false), result_.world_from_ct,
                                       is_robust(level) ? kCalibration_mismatch : kCalibration_explained);
    }
}

bool Driver::is_robust(Level& level) const {
    return run_.options.robust && result_.method == Method::gauss_newton &&
           level.report().cost_final >= kRobustFrom_cost;
}

void Driver::make_robust(Level& level) {
    if (!is_robust(level)) return;
    PixelWeights weights(level.session());
    for (int round = 0; round < kRobustRounds; ++round) {
        const RigidTransform before = result_.world_from_ct;
        weights.reweight(before);
        ++result_.robust_rounds;
        level.optimize(before, true, level.plan().pixel_at_object_mm);
        const double moved_mm = apart_mm(before, result_.world_from_ct, run_.extent);
        if (moved_mm < kRobustSettled_px * level.plan().pixel_at_object_mm) break;
    }
}

}  // namespace raylign
