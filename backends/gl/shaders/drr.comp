#version 450
// Casts one ray a pixel. In: frames (and their derivatives), the volume. Out: images: the DRR and, with DERIVATIVES, its six
// derivatives with respect to the pose. Work group: a tile of 8 x 8 pixels, PARTS invocations a ray, z = frame in work.

layout(local_size_x = 8, local_size_y = 8, local_size_z = PARTS) in;

#include "buffers.glsl"
#include "volume.glsl"
#include "ray.glsl"
#if JOSEPH
#include "joseph.glsl"
#else
#include "trilinear.glsl"
#endif

layout(location = 0) uniform uint first_frame;  // of those in work
layout(location = 1) uniform uint first_row;

/// dI / dp per unit of length: the gradient along the way of each sample.
float derivative_of(RaySums sums, Ray ray, ParameterData p, vec2 from_centre_px, int axis) {
    const vec3 turn = from_centre_px.x * p.step_u_voxel.xyz + from_centre_px.y * p.step_v_voxel.xyz;
    const vec3 position = p.position_voxel.xyz + ray.depth * turn, direction = p.direction_voxel.xyz + turn;
    float derivative = dot(sums.g0, position) + dot(sums.g1, direction);
#if JOSEPH
    // A sample stays in its plane, so its depth changes; and so does the length per plane (CONVENTIONS, section 8).
    derivative -= (dot(sums.g0, ray.direction) * position[axis] + dot(sums.g1, ray.direction) * direction[axis] +
                   sums.value * direction[axis]) / ray.direction[axis];
#endif
    return derivative;
}

#if PARTS > 1
const uint kTile = 64;
shared RaySums others[(PARTS - 1) * kTile];
#endif

/// The sums of all segments, in the tile's first layer of invocations. To be called by all.
RaySums march_in_parts(Ray ray) {
#if PARTS == 1
    return march(ray, 0, 1);
#else
    const uint pixel = gl_LocalInvocationID.y * 8 + gl_LocalInvocationID.x, part = gl_LocalInvocationID.z;
    RaySums sums = march(ray, int(part), PARTS);
    if (part > 0) others[(part - 1) * kTile + pixel] = sums;
    barrier();
    if (part == 0) {
        for (uint i = 0; i < PARTS - 1; ++i) sums = plus(sums, others[i * kTile + pixel]);
    }
    return sums;
#endif
}

void main() {
    const uint frame = first_frame + gl_WorkGroupID.z;
    const ViewData view = views[frames[frame].view.x];
    const uvec2 px = gl_GlobalInvocationID.xy + uvec2(0, first_row);
    // Those outside of the image march, too, along its border's rays: a barrier waits for all.
    const vec2 from_centre_px = vec2(min(px, view.size_px.xy - 1)) - view.centre_px.xy;
    const Ray ray = ray_of(frames[frame], from_centre_px);
    const RaySums sums = march_in_parts(ray);
    if (any(greaterThanEqual(px, view.size_px.xy)) || gl_LocalInvocationID.z > 0) return;
    const float unit = length_per_sample_mm(ray) * scene.texel.x;
    uint at = gl_WorkGroupID.z * (DERIVATIVES * kParameters + 1) * scene.counts.x + px.y * view.size_px.x + px.x;
    const float line_integral = unit * sums.value, ceiling = uintBitsToFloat(frames[frame].view.y);
    const float a = min(line_integral, ceiling), b = max(line_integral, ceiling);
    const float none = exp(-b), rest = a == 0 ? 0 : exp(a - b) - none;  // saturated() of core/geometry/ray_frame.h
    images[at] = rest == 0 ? a : a - log(1 + rest);  // exact there, whatever a driver's exp and log are
#if DERIVATIVES
#if JOSEPH
    const int axis = dominant_axis(ray.direction);
#else
    const int axis = 0;
#endif
    const float shown = unit * ((line_integral < ceiling ? 1 : exp(a - b)) - none) / (1 + rest);
    for (uint i = 0; i < kParameters; ++i) {
        at += scene.counts.x;
        images[at] = shown * derivative_of(sums, ray, derivatives[frame].parameters[i], from_centre_px, axis);
    }
#endif
}
