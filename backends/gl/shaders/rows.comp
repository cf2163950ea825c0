#version 450
// First pass of the gradient filter: along x, derivative and smoothing at once. In: images, taps. Out: rows. Each invocation
// makes four pixels of a row. Work group: 8 x 8 of them, z = image in work.

layout(local_size_x = 8, local_size_y = 8) in;

#include "buffers.glsl"

layout(location = 0) uniform uint first_frame;
layout(location = 2) uniform uint images_per_frame;
layout(location = 4) uniform uint smoothed_rows;  // where they begin

void main() {
    const uint image = gl_WorkGroupID.z;
    const ivec2 size = ivec2(views[frames[first_frame + image / images_per_frame].view.x].size_px.xy);
    const ivec2 at = ivec2(gl_GlobalInvocationID.xy) * ivec2(4, 1);
    if (at.x >= size.x || at.y >= size.y) return;
    const uint row = image * scene.counts.x + at.y * size.x;
    const int radius = int(scene.counts.w);
    vec4 derivative = vec4(0), smoothed = vec4(0);
    for (int k = -radius; k < radius + 4; ++k) {  // borders repeat the nearest pixel
        const float value = images[row + clamp(at.x + k, 0, size.x - 1)];
        const int tap = k + radius + 3;
        const vec4 a = taps[tap], b = taps[tap - 1], c = taps[tap - 2], d = taps[tap - 3];
        smoothed += value * vec4(a.x, b.x, c.x, d.x);
        derivative += value * vec4(a.y, b.y, c.y, d.y);
    }
    for (int i = 0; i < 4 && at.x + i < size.x; ++i) {
        rows[row + at.x + i] = derivative[i];
        rows[smoothed_rows + row + at.x + i] = smoothed[i];
    }
}
