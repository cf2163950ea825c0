#version 450
// As moments.comp, for the DRR and its six derivative images, channel CHANNEL. Out: partials, per channel: the three of
// moments.comp, then sum w J_i, sum w A J_i, sum w B J_i (6 each) and sum w J_i J_j (21, i <= j).
// Work group: 64 columns, y = four rows, z = frame in work.

layout(local_size_x = 64) in;

#include "buffers.glsl"
#include "filter.glsl"
const uint kSums = 42;
#include "block_sums.glsl"

layout(location = 0) uniform uint first_frame;

void main() {
    const uint slot = gl_WorkGroupID.z;
    const ViewData view = views[frames[first_frame + slot].view.x];
    const ivec2 size = ivec2(view.size_px.xy), corner = ivec2(gl_WorkGroupID.xy) * ivec2(64, 4);
    if (any(greaterThanEqual(corner, size))) return;  // the whole group
    const ivec2 at = corner + ivec2(gl_LocalInvocationID.x, 0);
    vec4 a0 = vec4(0), a1 = vec4(0), w = vec4(0), b[kParameters + 1];
    if (at.x < size.x) fixed_strip(view, at, a0, a1, w);
    const vec4 a = CHANNEL == 0 ? a0 : a1;
    for (uint i = 0; i <= kParameters; ++i) {
        b[i] = vec4(0);
        if (at.x < size.x) b[i] = strip_of(slot * (kParameters + 1) + i, at, size, CHANNEL);
    }
    put(0, dot(w, b[0]));
    put(1, dot(w * b[0], b[0]));
    put(2, dot(w * b[0], a));
    uint next = 21;
    for (uint i = 0; i < kParameters; ++i) {
        const vec4 weighted = w * b[1 + i];
        put(3 + i, dot(weighted, vec4(1)));
        put(9 + i, dot(weighted, a));
        put(15 + i, dot(weighted, b[0]));
        for (uint j = i; j < kParameters; ++j) put(next++, dot(weighted, b[1 + j]));
    }
    add_up(view, CHANNEL * kSums, scene.counts.z * kSums);
}
