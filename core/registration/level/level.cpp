#include "core/registration/level/level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/image/pyramid.h"
#include "core/image/view_crop.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

constexpr double kToleranceFinest_px = 5e-4;  // far below the 0.01 mm that backends must agree on
constexpr double kToleranceCoarse_px = 2e-2;  // the next level corrects the rest
constexpr double kCostToleranceFinest = 1e-10;
constexpr double kCostToleranceCoarse = 1e-6;
constexpr int kTypicalIterations = 15;  // per level: scales the progress estimate only

bool shows_anything(const Image& drr, const Image& weights) {
    for (std::size_t i = 0; i < drr.pixels.size(); ++i) {
        if (weights.pixels[i] > 0 && drr.pixels[i] > 0) return true;
    }
    return false;
}

}  // namespace

double level_work(const LevelPlan& plan) {
    // Halving images by 2 leaves a quarter of the rays; halving the volume, half of the samples on each.
    return std::exp2(-2.0 * plan.image_halvings.front() - plan.volume_halvings) * kTypicalIterations;
}

Level::Level(Run& run, const LevelPlan& plan, Content content, const std::optional<Focus>& focus)
    : run_(run), plan_(plan), index_(static_cast<int>(run.result.levels.size())) {
    const auto begin = Clock::now();
    make_views(focus);
    is_continued_ = content == Content::whole && !run.shows_the_cut.value_or(true) && may_continue();
    session_ = make_session();
    const Volume& volume = run.resident.halved(plan.volume_halvings);
    report_.volume_size = volume.grid.size;
    report_.spacing_mm = volume.grid.spacing_mm;
    for (const View& view : views_) report_.image_sizes_px.push_back(view.geometry.camera.size_px);
    report_.filter = plan.filter;
    report_.content = content;
    run.result.levels.emplace_back();  // its place, whenever it is closed
    run.level_clock.open(index_, begin);
}

void Level::make_views(const std::optional<Focus>& focus) {
    for (std::size_t v = 0; v < run_.views.size(); ++v) {
        View view = halved(run_.views[v], plan_.image_halvings[v]);
        if (focus) {
            const int margin_px = static_cast<int>(std::ceil(focus->margin_mm / plan_.pixel_at_object_mm)) +
                                  2 * plan_.filter.radius_px + 1;
            view = crop(view, reached_pixels(view.geometry, run_.volume().grid, focus->world_from_ct, margin_px));
        }
        views_.push_back(std::move(view));
    }
}

void Level::close() {
    RegistrationResult& result = run_.result;
    report_.volume_bytes = session_->volume_bytes();  // now that rays have asked for all copies that they need
    report_.volume_layout = session_->volume_layout();
    add(counters_, session_->counters());
    report_.evaluations = counters_.evaluations;
    report_.linearizations = counters_.linearizations;
    report_.time_s = run_.level_clock.close(index_);
    result.iterations += report_.iterations;
    add(result.counters, counters_);
    add(result.timing, session_->timing());
    result.timing.prepare_s += run_.resident.take_prepare_s();
    result.levels[index_] = std::move(report_);
}

Level::Known* Level::known(const RigidTransform& world_from_ct) {
    if (known_weights_ != session_->weight_changes()) known_.clear();
    known_weights_ = session_->weight_changes();
    const auto found = std::ranges::find_if(known_, [&](const Known& k) {
        return k.world_from_ct.rotation == world_from_ct.rotation &&
               k.world_from_ct.translation_mm == world_from_ct.translation_mm;
    });
    return found == known_.end() ? nullptr : &*found;
}

std::vector<double> Level::view_costs(const RigidTransform& world_from_ct) {
    if (const Known* found = known(world_from_ct)) return found->view_costs;
    const std::vector<MomentSums> sums = session_->moment_sums({&world_from_ct, 1});
    const auto channels = static_cast<std::size_t>(session_->channel_count());
    std::vector<double> costs;
    for (std::size_t v = 0; v < session_->view_count(); ++v) {
        costs.push_back(view_cost({sums.data() + v * channels, channels}));
    }
    known_.push_back({world_from_ct, costs});
    return costs;
}

double Level::cost(const RigidTransform& world_from_ct) {
    const std::vector<double> costs = view_costs(world_from_ct);
    double cost = 0;
    for (std::size_t v = 0; v < costs.size(); ++v) cost += session_->view_share(v) * costs[v];
    return cost;
}

void Level::linearize(const RigidTransform& world_from_ct) {
    if (known(world_from_ct)) return;
    std::vector<Linearization> views(session_->view_count());
    session_->linearize_views({&world_from_ct, 1}, run_.extent.centre_ct_mm, views);
    remember(world_from_ct, std::move(views));
}

void Level::remember(const RigidTransform& world_from_ct, std::vector<Linearization> views) {
    Known* place = known(world_from_ct);
    if (!place) {
        place = &known_.emplace_back(Known{world_from_ct, {}});
        for (const Linearization& view : views) place->view_costs.push_back(view.cost);
    }
    place->views = std::move(views);
}

std::unique_ptr<Session> Level::cut_out(const RigidTransform& world_from_ct, std::span<const Image> images,
                                        std::vector<Image>& cut) {
    std::vector<View> views;
    for (std::size_t v = 0; v < views_.size(); ++v) {
        const PixelBox box =
            reached_pixels(views_[v].geometry, run_.volume().grid, world_from_ct, 2 * plan_.filter.radius_px + 1);
        views.push_back(crop(views_[v], box));
        cut.push_back(crop(images[v], box));
    }
    try {
        return run_.resident.session(plan_.volume_halvings, views, {run_.options.similarity.metric, plan_.filter});
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        return nullptr;  // blank, or hardly a usable pixel
    }
}

std::unique_ptr<Session> Level::make_session() {
    const Similarity similarity{run_.options.similarity.metric, plan_.filter};
    if (is_continued_) return run_.resident.continued_session(plan_.volume_halvings, views_, similarity);
    return run_.resident.session(plan_.volume_halvings, views_, similarity);
}

bool Level::may_continue() const { return !plan_.is_finest && !run_.resident.cut_faces().empty(); }

void Level::go_beyond_the_cut(bool goes_on) {
    goes_on = goes_on && may_continue();
    if (is_continued_ == goes_on) return;
    count(*session_);
    is_continued_ = goes_on;
    renew_session();
}

void Level::show_up_to(double ceiling) {
    std::vector<Image> weights;
    for (std::size_t v = 0; v < views_.size(); ++v) {
        weights.push_back(session_->fixed_channels(v).weights);
        views_[v].ceiling = ceiling;
    }
    count(*session_);
    renew_session();
    session_->set_weights(weights);
}

void Level::renew_session() {
    session_ = make_session();
    known_.clear();
}

void Level::count(const Session& cut_out) {
    add(counters_, cut_out.counters());
    add(run_.result.timing, cut_out.timing());
}

LevelProblem Level::problem(const RigidTransform& start, bool finest, Session& session) {
    return {.session = session,
            .start_world_from_ct = start,
            .extent = run_.extent,
            .pixel_at_object_mm = plan_.pixel_at_object_mm,
            .initial_step_mm = plan_.pixel_at_object_mm,
            .step_tolerance_mm = (finest ? kToleranceFinest_px : kToleranceCoarse_px) * plan_.pixel_at_object_mm,
            .cost_tolerance = finest ? kCostToleranceFinest : kCostToleranceCoarse,
            .max_iterations = run_.options.max_iterations_per_level,
            .before_batch = [this] { stop_if_asked(run_); }};
}

void Level::take_the_better_start(bool may_restart) {
    RegistrationResult& result = run_.result;
    if (result.method == Method::gauss_newton) linearize(result.world_from_ct);
    report_.restarted = may_restart && cost(run_.start) < cost(result.world_from_ct);
    if (report_.restarted) result.world_from_ct = run_.start;
    report_.cost_initial = cost(result.world_from_ct);
}

LevelOutcome Level::solve(LevelProblem problem) {
    if (run_.is_hopeless) problem.max_iterations = std::min(problem.max_iterations, kSearchIterations);
    if (Known* start = known(problem.start_world_from_ct)) problem.at_start = std::exchange(start->views, {});
    const auto on_step = [&](const OptimizerStep& step, const RigidTransform& pose) {
        record(step, pose);
        return true;
    };
    const LevelOutcome found = run_method(run_.result.method, problem, on_step);
    run_.result.world_from_ct = found.world_from_ct;
    if (!found.views.empty()) remember(found.world_from_ct, found.views);
    report_.cost_final = found.cost;
    report_.iterations += found.iterations;
    report_.termination = found.termination;
    return found;
}

LevelOutcome Level::optimize(const RigidTransform& start, bool finest, double initial_step_mm) {
    LevelProblem work = problem(start, finest);
    work.initial_step_mm = initial_step_mm;
    return solve(work);
}

void Level::settle(bool finest) {
    LevelProblem work = problem(run_.result.world_from_ct, finest);
    work.learns = true;
    (void)solve(work);
}

void Level::record(const OptimizerStep& step, const RigidTransform& pose) {
    RegistrationResult& result = run_.result;
    result.history.push_back({index_, report_.iterations + step.iteration, step.cost, step.length, pose});
    result.world_from_ct = pose;
    result.cost_final = step.cost;
    const double share = static_cast<double>(step.iteration) / (kTypicalIterations + step.iteration);
    show_progress(run_, index_, share * level_work(plan_), step.cost, step.iteration);
}

void Level::check_overlap() {
    const std::vector<MomentSums> sums = session_->moment_sums({&run_.start, 1});
    const auto channels = static_cast<std::ptrdiff_t>(session_->channel_count());
    for (std::size_t v = 0; v < session_->view_count(); ++v) {
        const auto first = sums.begin() + static_cast<std::ptrdiff_t>(v) * channels;
        if (!std::all_of(first, first + channels, moving_is_constant)) continue;
        if (shows_anything(session_->render(run_.start, v), session_->fixed_channels(v).weights)) {
            throw Error("start pose: the DRR is the same on all usable pixels of view " + run_.views[v].name +
                        ": the object covers them and the detector sees nothing through it, so that nothing of its "
                        "outline is seen. Allowed: an object whose outline lies on usable pixels (is its unit right, "
                        "is it too near to the source?), or a saturation that lets its thickness be seen");
        }
        throw Error("start pose: the DRR misses the detector of view " + run_.views[v].name +
                    " (nothing of the volume is projected onto its usable pixels)");
    }
}

}  // namespace raylign::detail
