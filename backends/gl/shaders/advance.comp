#version 450
// One step of Levenberg-Marquardt for every search, in double: takes what the sums say of the pose looked at, solves for the next one
// and makes its frames, so that a device can go on by itself. The rule is that of core/optimize/levenberg_marquardt.cpp, the frames are
// those of core/geometry/ray_frame.cpp and frame_data.cpp. In: sums, cameras. In and out: searches, models. Out: frames and their
// derivatives, the work groups that look at them. One work group.

layout(local_size_x = 64) in;

#include "shared.glsl"
#include "descent_data.glsl"

layout(std430, binding = 0) writeonly buffer FrameBlock { FrameData frames[]; };
layout(std430, binding = 1) writeonly buffer DerivativeBlock { DerivativeData derivatives[]; };
layout(std430, binding = 2) readonly buffer ViewBlock { ViewData views[]; };
layout(std430, binding = 3) readonly buffer DescentBlock { DescentData descent; CameraData cameras[]; };
layout(std430, binding = 4) buffer SearchBlock { SearchData searches[]; };
layout(std430, binding = 5) buffer ModelBlock { ViewModel models[]; };      // [search][base, trial][view]
layout(std430, binding = 6) readonly buffer SumBlock { double sums[]; };    // [frame][channel][42], as in sums.comp
layout(std430, binding = 7) writeonly buffer GroupBlock { uint groups[]; };  // [chunk][cast, sums, total][x, y, z]

layout(location = 0) uniform uint is_first;  // of a submission

const uint kLanes = 64, kSums = 42;
const double kFarAway_mm = 1e30lf;
const uint kConverged = 0, kMaxIterations = 1, kNonFinite = 2;  // enum Termination

shared uint looking[kLanes];

#include "advance_models.glsl"
#include "advance_steps.glsl"
#include "advance_frames.glsl"

void finish(uint i, uint termination) {
    searches[i].state = kDone;
    searches[i].termination = termination;
}

void propose(uint i) {
    if (searches[i].linearizations > descent.max_iterations) {
        finish(i, kMaxIterations);
        return;
    }
    double promised;
    const double step[6] = damped_step(i, promised);
    searches[i].step = step;
    if (!(norm_of(step) >= descent.step_tolerance) || promised < descent.decrease_tolerance) {
        finish(i, kConverged);
        return;
    }
    move_trial(i, step);
    searches[i].state = kToLook;
}

void note_step(uint i, double cost) {
    ++searches[i].iterations;
    const uint taken = searches[i].taken;
    for (uint k = 0; k < 12; ++k) searches[i].taken_poses[12 * taken + k] = searches[i].trial[k];
    searches[i].taken_costs[taken] = cost;
    searches[i].taken_lengths[taken] = searches[i].last_length;
    searches[i].taken = taken + 1;
}

/// The trial pose becomes the base, and `model`, of all views, what is known there.
void accept(uint i, Model model) {
    searches[i].base = searches[i].trial;
    searches[i].cost = model.cost;
    searches[i].gradient = model.gradient;
    searches[i].curvature = model.curvature;
    const uint base = 2 * i * descent.views;
    for (uint v = 0; v < descent.views; ++v) models[base + v] = models[base + descent.views + v];
}

/// What is known of the trial pose; true if a next step is to be found.
bool take(uint i, Model model) {
    const bool is_fresh = searches[i].is_fresh != 0, is_lower = model.is_finite && model.cost < searches[i].cost;
    searches[i].is_fresh = 0;
    ++searches[i].linearizations;
    if (is_fresh) {
        accept(i, model);
    } else if (is_lower) {
        if (descent.learns != 0) learn_missing(i, model);
        searches[i].last_length = norm_of(searches[i].step);
        searches[i].damping = max(searches[i].damping * descent.damping_down, descent.least_damping);
        note_step(i, model.cost);
        accept(i, model);
    } else {
        searches[i].damping = max(searches[i].damping * descent.damping_up, descent.least_damping_up);
    }
    if (!model.is_finite) {
        finish(i, kNonFinite);
    } else if (searches[i].damping > descent.largest_damping) {
        finish(i, kConverged);
    }
    return searches[i].state != kDone;
}

/// Until the search waits for sums, for a layout of the volume, or is done.
void advance(uint i) {
    if (is_first != 0) searches[i].taken = 0;
    const uint state = searches[i].state, trial = (2 * i + 1) * descent.views;
    if (state == kLooking) look(searches[i].frame, trial);
    if (state == kLooking || state == kKnown) {
        if (take(i, sum_of_views(trial))) propose(i);
    }
    if (searches[i].state != kToLook) return;
    bool can_be_seen;
    searches[i].needed_layouts = axes_met(i, can_be_seen) & ~descent.layouts;
    if (!can_be_seen) {
        searches[i].state = kRefused;
    } else if (searches[i].needed_layouts == 0) {
        searches[i].state = kLooking;
    }
}

void main() {
    const uint lane = gl_LocalInvocationID.x;
    uint own = 0;
    for (uint i = lane; i < descent.searches; i += kLanes) {
        advance(i);
        if (searches[i].state == kLooking) ++own;
    }
    looking[lane] = own;
    barrier();
    uint frame = 0;
    for (uint k = 0; k < lane; ++k) frame += looking[k] * descent.views;
    for (uint i = lane; i < descent.searches; i += kLanes) {
        if (searches[i].state != kLooking) continue;
        searches[i].frame = frame;
        for (uint v = 0; v < descent.views; ++v) write_frame(i, v, frame++);
    }
    if (lane == kLanes - 1) write_groups(frame);
}
