#include "raylign/tracking.h"

#include <algorithm>
#include <cmath>

#include "core/base/clock.h"
#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/number_text.h"
#include "core/registration/level/plan.h"
#include "core/registration/policy.h"
#include "core/registration/registration.h"
#include "core/registration/trust/confidence.h"
#include "core/tracking/attempt.h"
#include "core/tracking/depth_prior.h"
#include "core/tracking/extrapolation.h"
#include "core/tracking/frame_views.h"
#include "core/tracking/quick_way.h"

namespace raylign {
using namespace detail;
namespace {

constexpr std::size_t kRemembered = 15, kFewest = 3;    // frames whose medians say what is usual
constexpr double kFirstJump_mm = kNearRange_mm;         // what a search near the prediction covers
constexpr double kJumpFloor_mm = 3, kJumpFactor = 4;    // above the noise of a prediction; sudden starts of a motion
constexpr double kMostGaps = 3;                         // beyond, a body has gone as far as it will
constexpr double kCostFloor = 0.03, kCostShare = 0.25;  // noise; and how much costs change along a motion
constexpr double kSame_mm = 1;                          // ends of searches that confirm each other
constexpr int kHopeless = 3, kRetry = 10;
/// At the object's rim, ends of the quick and of the full way: what their noise explains, and no more than a
/// registration of one frame is off by anyway.
constexpr double kAlike_mm = 0.2, kAlike_px = 0.25;

void push(std::vector<double>& values, double value) {
    values.push_back(value);
    if (values.size() > kRemembered) values.erase(values.begin());
}

}  // namespace

/// What a tracker keeps from frame to frame.
struct Tracker::State {
    State(const Volume& volume, const RigidTransform& start_world_from_ct, const TrackOptions& options,
          Backend& backend);

    void check_number(int frame) const;
    [[nodiscard]] RigidTransform predicted(int frame) const;
    [[nodiscard]] double jump_limit_mm(int frame) const;
    [[nodiscard]] double cost_limit() const;
    [[nodiscard]] Attempt attempt(const RegistrationOptions& options, const TrackFrame& so_far,
                                  std::span<const View> views, const RunControl& control);
    [[nodiscard]] bool may_go_quickly(int frame) const;
    [[nodiscard]] Attempt quick_attempt(const TrackFrame& so_far, std::span<const View> views,
                                        const RunControl& control);
    [[nodiscard]] bool are_alike(const Attempt& quick, const Attempt& full, std::span<const View> views) const;
    [[nodiscard]] double error_ratio(const Attempt& quick, const Attempt& full) const;
    void widen(Confidence& expected, std::span<const View> views, const RigidTransform& world_from_ct) const;
    void compare_jump(Attempt& made, const TrackFrame& so_far) const;
    [[nodiscard]] RegistrationOptions first_options() const;
    [[nodiscard]] TrackFrame find(int frame, FrameViews& views, const RunControl& control);
    void search_wider(Attempt& best, TrackFrame& found, std::span<const View> views, const RunControl& control);
    void hold_depth(Attempt& best, int frame, std::span<const View> views) const;
    void judge(const Attempt& best, TrackFrame& found) const;
    void remember(const TrackFrame& found);

    ResidentVolume resident_;
    RigidTransform start_world_from_ct_;
    TrackOptions options_;
    ObjectExtent extent_;
    std::vector<TimedPose> known_;          ///< tracked frames since the last jump, the last few
    std::vector<double> jumps_mm_, costs_;  ///< of the last tracked frames
    std::optional<Content> content_;
    std::optional<int> last_frame_, last_tracked_;
    double last_in_depth_mm_ = 0;  ///< expected, of the last tracked frame; 0 = not known
    int failures_ = 0;             ///< frames in a row that no search has helped
    QuickWay quick_;
    bool was_ok_ = false;  ///< the frame before
};

Tracker::State::State(const Volume& volume, const RigidTransform& start_world_from_ct, const TrackOptions& options,
                      Backend& backend)
    : resident_(volume, options.registration.render, backend),
      start_world_from_ct_(start_world_from_ct),
      options_(options),
      extent_(resident_.extent()) {
    if (const std::string fault = options.problem(); !fault.empty()) throw Error("track options: " + fault);
    if (!is_finite(start_world_from_ct)) throw Error("start pose: must have finite numbers only");
    check_options(options.registration, backend);
    if (!backend.info().has_derivatives) options_.recovery = Search::none;
    options_.registration.suspect_mirrored = false;  // a track's first frame tells, and each would pay for it
    options_.registration.look_around = false;       // the prediction is near, and a lost frame is searched for
}

void Tracker::State::check_number(int frame) const {
    if (!last_frame_ || frame > *last_frame_) return;
    throw bad_value("frame", std::to_string(frame), "above that of the frame before, " + std::to_string(*last_frame_));
}

RigidTransform Tracker::State::predicted(int frame) const {
    if (known_.empty()) return start_world_from_ct_;
    return extrapolate(known_, frame / options_.frame_step, extent_.centre_ct_mm);
}

double Tracker::State::jump_limit_mm(int frame) const {
    const bool is_new = jumps_mm_.size() < kFewest || known_.size() < 2;  // no velocity yet
    const double limit_mm = options_.max_jump_mm ? *options_.max_jump_mm
                            : is_new             ? kFirstJump_mm
                                                 : kJumpFloor_mm + kJumpFactor * median(jumps_mm_);
    const double missed = (frame - last_tracked_.value_or(frame)) / options_.frame_step;
    return limit_mm * std::clamp(missed, 1.0, kMostGaps);
}

double Tracker::State::cost_limit() const {
    if (costs_.size() < kFewest) return 2;                 // the largest that there is
    const double usual = median(costs_) * quick_.drift();  // frames found quickly have no such cost
    return usual + kCostFloor + kCostShare * usual;
}

RegistrationOptions Tracker::State::first_options() const {
    RegistrationOptions options = options_.registration;
    options.compare_views = false;       // cameras are those of all frames: one registration tells, and frames are many
    if (!last_tracked_) return options;  // gaps before the first frame do not count
    if (content_) options.content = *content_;
    options.search.mode = Search::none;
    options.search.range_mm = options.search.range_deg = std::nullopt;
    options.search.starts = std::nullopt;
    return options;
}

Attempt Tracker::State::attempt(const RegistrationOptions& options, const TrackFrame& so_far,
                                std::span<const View> views, const RunControl& control) {
    Attempt made;
    const RigidTransform& prediction = so_far.predicted_world_from_ct;
    try {
        made.result = register_resident(resident_, views, prediction, options, control);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        made.problem = error.what();  // e.g. that the DRR misses a view from here: a wider search may help
        return made;
    }
    made.has_result = std::isfinite(made.result.cost_final) && is_finite(made.result.world_from_ct);
    if (!made.has_result) made.problem = "the cost is not finite";
    made.is_search = made.result.search.mode != Search::none;
    compare_jump(made, so_far);
    made.cost_jumped = made.result.cost_final > cost_limit();
    return made;
}

void Tracker::State::compare_jump(Attempt& made, const TrackFrame& so_far) const {
    made.jump_mm = apart_mm(made.result.world_from_ct, so_far.predicted_world_from_ct, extent_);
    made.jumped = last_tracked_ && made.jump_mm > jump_limit_mm(so_far.frame);
}

/// A prediction is near where a velocity is known and the frame before was found.
bool Tracker::State::may_go_quickly(int frame) const {
    const Method method = options_.registration.method;
    const bool is_newton = method == Method::automatic || method == Method::gauss_newton;
    return options_.quick && quick_.is_open() && was_ok_ && content_ == Content::part && is_newton &&
           options_.registration.robust && resident_.backend().info().has_derivatives && known_.size() >= 2 &&
           frame - *last_tracked_ <= 1.5 * options_.frame_step;
}

Attempt Tracker::State::quick_attempt(const TrackFrame& so_far, std::span<const View> views,
                                      const RunControl& control) {
    Attempt made;
    try {
        made.result = follow_resident(resident_, views, so_far.predicted_world_from_ct, first_options(),
                                      quick_.coarser_by(), control);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        return made;
    }
    made.has_result = std::isfinite(made.result.cost_final) && is_finite(made.result.world_from_ct);
    if (!made.has_result) return made;
    compare_jump(made, so_far);
    made.cost_jumped = quick_.is_confirmed() && !quick_.is_usual(made.result.view_costs);
    return made;
}

bool Tracker::State::are_alike(const Attempt& quick, const Attempt& full, std::span<const View> views) const {
    const std::vector<LevelPlan> levels =
        plan_levels(resident_.volume(), views, full.result.world_from_ct, extent_, {}, options_.registration.levels);
    return apart_mm(quick.result.world_from_ct, full.result.world_from_ct, extent_) <
           std::max(kAlike_mm, kAlike_px * levels.back().pixel_at_object_mm);
}

/// What the two ways are apart is an error of one of them, at least half of it of the quick one or the full one; noise,
/// which both share, comes on top.
double Tracker::State::error_ratio(const Attempt& quick, const Attempt& full) const {
    const double expected_mm = quick.result.confidence.rim_mm, of_full_mm = full.result.confidence.rim_mm;
    if (!(expected_mm > 0)) return 1;
    const double apart = apart_mm(quick.result.world_from_ct, full.result.world_from_ct, extent_);
    return std::max({1.0, of_full_mm / expected_mm, std::hypot(1, apart / (2 * expected_mm))});
}

/// Of a frame that was found quickly, by what the full way expected where both were gone.
void Tracker::State::widen(Confidence& expected, std::span<const View> views,
                           const RigidTransform& world_from_ct) const {
    if (!expected.is_estimated) return;
    expected.covariance *= quick_.error_ratio() * quick_.error_ratio();
    summarise(expected, extent_.radius_mm);
    if (views.size() != 1) return;
    const Eigen::Vector3d centre_mm = world_from_ct * extent_.centre_ct_mm;
    split_by_depth(expected, (centre_mm - source_world_mm(views.front().geometry)).normalized());
}

void Tracker::State::search_wider(Attempt& best, TrackFrame& found, std::span<const View> views,
                                  const RunControl& control) {
    if (control.stop.stop_requested()) return;
    if (failures_ >= kHopeless && failures_ % kRetry != 0) return;
    const RegistrationOptions first = first_options();
    for (const RegistrationOptions& options : wider_searches(first, options_.recovery)) {
        const Attempt next = attempt(options, found, views, control);
        found.searched = options.search.mode;
        if (!next.has_result) continue;
        const bool same =
            best.has_result && apart_mm(next.result.world_from_ct, best.result.world_from_ct, extent_) < kSame_mm;
        // Costs say nothing here: each was made under the robust weights of its own pose.
        if (next.believed() || !best.has_result) {
            found.recovered = found.recovered || !same;
            best = next;
        }
        if (best.believed()) return;
    }
}

/// What the last frame says of this one's depth.
void Tracker::State::hold_depth(Attempt& best, int frame, std::span<const View> views) const {
    const bool is_known = !known_.empty() && last_in_depth_mm_ > 0;
    if (!options_.depth_change_mm || views.size() != 1 || !best.believed() || !is_known) return;
    const double steps = (frame - *last_tracked_) / options_.frame_step;
    const double sigma_mm = std::hypot(*options_.depth_change_mm * std::sqrt(steps), last_in_depth_mm_);
    const Eigen::Vector3d before_mm = known_.back().world_from_ct * extent_.centre_ct_mm;
    const Eigen::Vector3d found_mm = best.result.world_from_ct * extent_.centre_ct_mm;
    const DepthPrior prior = depth_like(before_mm, sigma_mm, found_mm, source_world_mm(views.front().geometry));
    (void)join_depth(best.result, prior, extent_.centre_ct_mm, extent_.radius_mm);
}

void Tracker::State::judge(const Attempt& best, TrackFrame& found) const {
    if (!best.has_result) {
        found.status = TrackStatus::lost;
        found.world_from_ct = found.predicted_world_from_ct;
        found.reasons.push_back(best.problem);
        return;
    }
    found.world_from_ct = best.result.world_from_ct;
    found.jump_mm = best.jump_mm;
    found.jumped = best.jumped;
    if (best.result.ok) found.content = best.result.content;
    found.cost = best.result.cost_final;
    found.view_costs = best.result.view_costs;
    const Confidence& confidence = best.result.confidence;
    found.expected_error_mm = confidence.rim_mm;
    found.expected_in_plane_mm = confidence.in_plane_mm;
    found.expected_in_depth_mm = confidence.in_depth_mm;
    found.expected_turn_deg = confidence.rotation_deg;
    found.status = best.believed() ? TrackStatus::ok : best.plausible() ? TrackStatus::doubtful : TrackStatus::lost;
    if (found.status == TrackStatus::ok) return;
    found.reasons = best.result.reasons;
    if (best.jumped) {
        found.reasons.push_back(fixed(best.jump_mm, 2) + " mm from the prediction, more than " +
                                fixed(jump_limit_mm(found.frame), 2) + " mm");
    }
    if (best.cost_jumped) {
        found.reasons.push_back("the cost " + fixed(best.result.cost_final, 2) +
                                " is far above that of the frames before, " + fixed(median(costs_), 2));
    }
}

void Tracker::State::remember(const TrackFrame& found) {
    last_frame_ = found.frame;
    was_ok_ = found.status == TrackStatus::ok;
    quick_.remember(found);
    if (found.status == TrackStatus::missing || found.status == TrackStatus::stopped) return;
    failures_ = found.status == TrackStatus::ok ? 0 : failures_ + 1;
    if (found.status == TrackStatus::lost) return;
    if (!content_ && found.content != Content::automatic) content_ = found.content;
    last_in_depth_mm_ = found.jumped ? 0 : found.expected_in_depth_mm;
    if (found.jumped) {
        known_.clear();  // across a jump there is no velocity
    } else if (last_tracked_) {
        push(jumps_mm_, found.jump_mm);
    }
    if (!found.quick) push(costs_, found.cost);
    known_.push_back({found.frame / options_.frame_step, found.world_from_ct});
    if (known_.size() > kFewest) known_.erase(known_.begin());
    last_tracked_ = found.frame;
}

Tracker::Tracker(const Volume& volume, const RigidTransform& start_world_from_ct, const TrackOptions& options,
                 Backend& backend)
    : state_(std::make_unique<State>(volume, start_world_from_ct, options, backend)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

RigidTransform Tracker::predicted(int frame) const { return state_->predicted(frame); }

TrackFrame Tracker::State::find(int frame, FrameViews& views, const RunControl& control) {
    check_number(frame);
    const auto begin = Clock::now();
    TrackFrame found{.frame = frame, .predicted_world_from_ct = predicted(frame)};
    std::optional<Attempt> quick;
    if (may_go_quickly(frame)) quick = quick_attempt(found, views.coarser(quick_.coarser_by()), control);
    if (quick && !quick->believed()) quick.reset();
    if (quick) found.quick_view_costs = quick->result.view_costs;
    found.quick = quick && quick_.is_confirmed();
    const std::span<const View> seen = found.quick ? views.coarser(quick_.coarser_by()) : views.in_full();
    Attempt best = found.quick ? *quick : attempt(first_options(), found, seen, control);
    if (best.has_result) found.searched = best.result.search.mode;
    if (!best.believed()) search_wider(best, found, seen, control);
    if (quick && !found.quick) found.quick_agrees = best.believed() && are_alike(*quick, best, seen);
    if (found.quick_agrees) found.quick_error_ratio = error_ratio(*quick, best);
    if (found.quick) widen(best.result.confidence, seen, best.result.world_from_ct);
    hold_depth(best, frame, seen);
    judge(best, found);
    if (control.stop.stop_requested()) {
        found.status = TrackStatus::stopped;
    } else {
        remember(found);
    }
    found.time_s = seconds_since(begin);
    return found;
}

TrackFrame Tracker::feed(int frame, std::span<const View> views, const RunControl& control) {
    FrameViews given(views);
    return state_->find(frame, given, control);
}

TrackFrame Tracker::feed(int frame, const ViewsFor& views, const RunControl& control) {
    FrameViews made(views);
    return state_->find(frame, made, control);
}

void Tracker::recall(const TrackFrame& frame) {
    state_->check_number(frame.frame);
    state_->remember(frame);
}

TrackFrame Tracker::skip(int frame, const std::string& reason) {
    state_->check_number(frame);
    state_->last_frame_ = frame;
    state_->was_ok_ = false;
    const RigidTransform expected = state_->predicted(frame);
    return {.frame = frame,
            .status = TrackStatus::missing,
            .world_from_ct = expected,
            .predicted_world_from_ct = expected,
            .reasons = {reason}};
}

}  // namespace raylign
