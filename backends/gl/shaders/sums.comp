#version 450
// The gradient filter and the weighted sums of blocks of pixels at once: what is filtered stays in the work group. In: images (a frame
// has its DRR and, with DERIVATIVES, six derivatives), fixed pixels. Out: partials, per channel: sum w B, sum w B^2, sum w A B; with
// DERIVATIVES then sum w J_i, sum w A J_i, sum w B J_i (6 each) and sum w J_i J_j (21, i <= j).
// Work group: a tile of 16 x 64 pixels, z = frame in work.

#include "buffers.glsl"

const int kImages = DERIVATIVES * int(kParameters) + 1, kSums = 3 + DERIVATIVES * 39;
const int kBlockFloats = kSums * 18;  // a block: the strips side by side
const int kSumFloats = 8 * kBlockFloats;

#include "strips.glsl"

layout(location = 0) uniform uint first_frame;

void put(int sum, float value) {
    scratch[int(gl_LocalInvocationID.y) * kBlockFloats + sum * kPitch + int(gl_LocalInvocationID.x)] = value;
}

void put_all(Strip b[kImages], Strip a, Strip w) {
    put(0, sum_of(w, b[0]));
    put(1, sum_of(times(w, b[0]), b[0]));
    put(2, sum_of(times(w, b[0]), a));
#if DERIVATIVES
    const Strip one = Strip(vec4(1), vec4(1));
    int next = 21;
    for (int i = 1; i < kImages; ++i) {
        const Strip weighted = times(w, b[i]);
        put(2 + i, sum_of(weighted, one));
        put(8 + i, sum_of(weighted, a));
        put(14 + i, sum_of(weighted, b[0]));
        for (int j = i; j < kImages; ++j) put(next++, sum_of(weighted, b[j]));
    }
#endif
}

/// Of what all have put, one invocation for each sum of a block adds it up in double, first to last.
void add_up(ViewData view, int channel) {
    barrier();
    const uint across = (view.size_px.x + kColumns - 1) / kColumns;
    for (int i = int(gl_LocalInvocationIndex); i < kSums * kStripsDown; i += kLanes) {
        const int down = i / kSums, sum = i % kSums;
        const uint block = (gl_WorkGroupID.y * kStripsDown + down) * across + gl_WorkGroupID.x;
        if (block >= view.size_px.w) break;
        double total = 0;
        for (int x = 0; x < kColumns; ++x) total += double(scratch[down * kBlockFloats + sum * kPitch + x]);
        partials[((gl_WorkGroupID.z * (GRADIENT + 1) + channel) * kSums + sum) * scene.counts.y + block] = total;
    }
    barrier();
}

/// Fixed images and weights of the strip; weight 0 outside of the image.
void fixed_strip(ViewData view, ivec2 at, out Strip fixed_0, out Strip fixed_1, out Strip weights) {
    fixed_0 = fixed_1 = weights = kNothing;
    for (int i = 0; i < kStrip && at.x < int(view.size_px.x) && at.y + i < int(view.size_px.y); ++i) {
        const vec4 pixel = fixed_pixels[view.size_px.z + (at.y + i) * view.size_px.x + at.x];
        if (i < 4) {
            fixed_0.upper[i] = pixel.x;
            fixed_1.upper[i] = pixel.y;
            weights.upper[i] = pixel.z;
        } else {
            fixed_0.lower[i - 4] = pixel.x;
            fixed_1.lower[i - 4] = pixel.y;
            weights.lower[i - 4] = pixel.z;
        }
    }
}

void main() {
    const ViewData view = views[frames[first_frame + gl_WorkGroupID.z].view.x];
    const ivec2 size = ivec2(view.size_px.xy), corner = ivec2(gl_WorkGroupID.xy) * ivec2(kColumns, kRows);
    if (any(greaterThanEqual(corner, size))) return;  // the whole group
    const ivec2 at = corner + ivec2(gl_LocalInvocationID.xy) * ivec2(1, kStrip);
    Strip b[kImages], c[kImages];  // of both channels
    for (int i = 0; i < kImages; ++i) {
        const uint first = (gl_WorkGroupID.z * kImages + i) * scene.counts.x;
#if GRADIENT
        filter_rows(first, corner, size);
        barrier();
        b[i] = filter_column(0);
        c[i] = filter_column(1);
        barrier();
#else
        b[i] = strip_of(first, at, size);
#endif
    }
    Strip a0, a1, w;
    fixed_strip(view, at, a0, a1, w);
    put_all(b, a0, w);
    add_up(view, 0);
#if GRADIENT
    put_all(c, a1, w);
    add_up(view, 1);
#endif
}
