#version 450
// Second pass of the filter and the weighted sums of strips of four pixels. In: rows (or images), fixed pixels. Out: partials,
// per channel: sum w B, sum w B^2, sum w A B. Work group: 64 columns, y = strips down, z = frame in work.

layout(local_size_x = 64) in;

#include "buffers.glsl"
#include "filter.glsl"

layout(location = 0) uniform uint first_frame;

void put(uint sum, uint strip, float value) {
    partials[(gl_WorkGroupID.z * scene.counts.z * 3 + sum) * scene.counts.y + strip] = value;
}

void main() {
    const ViewData view = views[frames[first_frame + gl_WorkGroupID.z].view.x];
    const ivec2 at = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, 4);
    if (at.x >= view.size_px.x || at.y >= view.size_px.y) return;
    vec4 b0, b1, a0, a1, w;
    strip_of(gl_WorkGroupID.z, at, ivec2(view.size_px.xy), b0, b1);
    fixed_strip(view, at, a0, a1, w);
    const uint strip = gl_GlobalInvocationID.y * view.size_px.x + gl_GlobalInvocationID.x;
    put(0, strip, dot(w, b0));
    put(1, strip, dot(w * b0, b0));
    put(2, strip, dot(w * b0, a0));
#if GRADIENT
    put(3, strip, dot(w, b1));
    put(4, strip, dot(w * b1, b1));
    put(5, strip, dot(w * b1, a1));
#endif
}
