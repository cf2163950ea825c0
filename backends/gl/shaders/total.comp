#version 450
// Adds up the partial sums in double, always in the same order: lane i takes every 64th strip from i on, then the lanes are
// added. How many sums a work group takes does not matter to the result. In: partials. Out: sums.
// Work group: 64 lanes, x = SUMS_PER_GROUP sums, z = frame in work.

layout(local_size_x = 64) in;

#include "buffers.glsl"

layout(location = 0) uniform uint first_frame;
layout(location = 3) uniform uint sums_per_frame;

const uint kLanes = 64;
shared double lanes[SUMS_PER_GROUP * kLanes];

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uint frame = first_frame + gl_WorkGroupID.z;
    const uint strips = views[frames[frame].view.x].size_px.w;
    const uint first = gl_WorkGroupID.x * uint(SUMS_PER_GROUP);
    const uint count = min(uint(SUMS_PER_GROUP), sums_per_frame - first);
    for (uint i = 0; i < count; ++i) {
        const uint base = (gl_WorkGroupID.z * sums_per_frame + first + i) * scene.counts.y;
        double sum = 0;
        for (uint strip = lane; strip < strips; strip += kLanes) sum += double(partials[base + strip]);
        lanes[i * kLanes + lane] = sum;
    }
    barrier();
    for (uint i = lane; i < count; i += kLanes) {
        double sum = 0;
        for (uint other = 0; other < kLanes; ++other) sum += lanes[i * kLanes + other];
        sums[frame * sums_per_frame + first + i] = sum;
    }
}
