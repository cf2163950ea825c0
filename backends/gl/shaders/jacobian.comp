#version 450
// As moments.comp, for the DRR and its six derivative images, channel CHANNEL. Out: partials, per channel: the three of
// moments.comp, then sum w J_i, sum w A J_i, sum w B J_i (6 each) and sum w J_i J_j (21, i <= j).
// Work group: 64 columns, y = strips down, z = frame in work.

layout(local_size_x = 64) in;

#include "buffers.glsl"
#include "filter.glsl"

layout(location = 0) uniform uint first_frame;

const uint kSums = 42;

void put(uint sum, uint strip, float value) {
    partials[((gl_WorkGroupID.z * scene.counts.z + CHANNEL) * kSums + sum) * scene.counts.y + strip] = value;
}

void main() {
    const uint slot = gl_WorkGroupID.z;
    const ViewData view = views[frames[first_frame + slot].view.x];
    const ivec2 at = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, 4);
    if (at.x >= view.size_px.x || at.y >= view.size_px.y) return;
    vec4 a0, a1, w, b[kParameters + 1];
    fixed_strip(view, at, a0, a1, w);
    const vec4 a = CHANNEL == 0 ? a0 : a1;
    for (uint i = 0; i <= kParameters; ++i) {
        b[i] = strip_of(slot * (kParameters + 1) + i, at, ivec2(view.size_px.xy), CHANNEL);
    }
    const uint strip = gl_GlobalInvocationID.y * view.size_px.x + gl_GlobalInvocationID.x;
    put(0, strip, dot(w, b[0]));
    put(1, strip, dot(w * b[0], b[0]));
    put(2, strip, dot(w * b[0], a));
    uint next = 21;
    for (uint i = 0; i < kParameters; ++i) {
        const vec4 weighted = w * b[1 + i];
        put(3 + i, strip, dot(weighted, vec4(1)));
        put(9 + i, strip, dot(weighted, a));
        put(15 + i, strip, dot(weighted, b[0]));
        for (uint j = i; j < kParameters; ++j) put(next++, strip, dot(weighted, b[1 + j]));
    }
}
