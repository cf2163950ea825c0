#version 450
// Second pass of the filter and the weighted sums of blocks of pixels. In: rows (or images), fixed pixels. Out: partials, per
// channel: sum w B, sum w B^2, sum w A B. Work group: 64 columns, y = four rows, z = frame in work.

layout(local_size_x = 64) in;

#include "buffers.glsl"
#include "filter.glsl"
const uint kSums = 3 * (GRADIENT + 1);
#include "block_sums.glsl"

layout(location = 0) uniform uint first_frame;

void main() {
    const ViewData view = views[frames[first_frame + gl_WorkGroupID.z].view.x];
    const ivec2 size = ivec2(view.size_px.xy), corner = ivec2(gl_WorkGroupID.xy) * ivec2(64, 4);
    if (any(greaterThanEqual(corner, size))) return;  // the whole group
    const ivec2 at = corner + ivec2(gl_LocalInvocationID.x, 0);
    vec4 a[2] = vec4[2](vec4(0), vec4(0)), w = vec4(0);
    if (at.x < size.x) fixed_strip(view, at, a[0], a[1], w);
    for (int channel = 0; channel <= GRADIENT; ++channel) {
        vec4 b = vec4(0);
        if (at.x < size.x) b = strip_of(gl_WorkGroupID.z, at, size, channel);
        put(3 * channel, dot(w, b));
        put(3 * channel + 1, dot(w * b, b));
        put(3 * channel + 2, dot(w * b, a[channel]));
    }
    add_up(view, 0, kSums);
}
