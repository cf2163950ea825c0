#version 450
// Adds up the sums of blocks, always in the same order: lane i takes every 64th block from i on, then the lanes are added.
// In: partials. Out: sums. Work group: 64 lanes, x = sum, z = frame in work.

layout(local_size_x = 64) in;

#include "buffers.glsl"

layout(location = 0) uniform uint first_frame;

const uint kLanes = 64;
shared double lanes[kLanes];

void main() {
    const uint lane = gl_LocalInvocationID.x, sums_per_frame = gl_NumWorkGroups.x;
    const uint frame = first_frame + gl_WorkGroupID.z;
    const uint blocks = views[frames[frame].view.x].size_px.w;
    const uint base = (gl_WorkGroupID.z * sums_per_frame + gl_WorkGroupID.x) * scene.counts.y;
    double sum = 0;
    for (uint block = lane; block < blocks; block += kLanes) sum += partials[base + block];
    lanes[lane] = sum;
    barrier();
    if (lane > 0) return;
    sum = 0;
    for (uint other = 0; other < kLanes; ++other) sum += lanes[other];
    sums[frame * sums_per_frame + gl_WorkGroupID.x] = sum;
}
