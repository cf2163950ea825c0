#version 450
// One slice of the volume as seen from the source; blending adds up the slices. In: frame and view, the volume. Out: what this
// slice adds to the line integral. JOSEPH: object-aligned slices, the planes of one axis [LaRose 2001]; rays of other axes come
// in other draws. Else view-aligned: at equal distances from the source [Ino06].

#define DERIVATIVES 0
#include "buffers.glsl"
#include "volume.glsl"
#include "ray.glsl"
#include "joseph.glsl"

layout(location = 0) flat in int slice;
layout(location = 0) out float line_integral;

// Uniforms, not storage: read for every sample.
layout(std140, binding = 2) uniform DrawBlock {
    FrameData frame;
    ViewData view;
};
layout(location = 1) uniform int first_slice;

#if JOSEPH
// Axes of the layers: those that vary along columns and rows, and the one across. AXIS is a define, so that no driver reads
// from all three.
#if AXIS == 0
#define LAYERS layers_x
const ivec3 kAxes = ivec3(1, 2, 0);
#elif AXIS == 1
#define LAYERS layers_y
const ivec3 kAxes = ivec3(0, 2, 1);
#else
#define LAYERS layers_z
const ivec3 kAxes = ivec3(0, 1, 2);
#endif

float sample_of(Ray ray, out float length_mm) {
    const float plane = first_slice + slice;
    const float depth = (plane - ray.position[AXIS]) / ray.direction[AXIS];
    length_mm = abs(1 / ray.direction[AXIS]) * length(scene.spacing_mm.xyz * ray.direction);
    if (dominant_axis(ray.direction) != AXIS || !(depth > -ray.depth && depth < ray.to_detector)) discard;
    const vec3 at = ray.position + depth * ray.direction;
    const vec2 y = vec2(at[kAxes.x], at[kAxes.y]);
#if EXACT
    const vec2 base = floor(y);
    return bilinear(corners(LAYERS, base, plane), y - base);
#else
    return filtered(LAYERS, y, plane);
#endif
}
#else
float sample_of(Ray ray, out float length_mm) {
    length_mm = scene.volume_size.w;
    const float per_step = length_mm / length(scene.spacing_mm.xyz * ray.direction);
    // Counted from the step before `position`, so that depths stay small.
    const float before = max(floor(ray.depth / per_step), 0);
    const float depth = (before + 0.5) * per_step - ray.depth + (float(first_slice + slice) - before) * per_step;
    if (!(depth < ray.to_detector)) discard;
    const vec3 y = ray.position + depth * ray.direction;
#if EXACT
    return gradient_and_value(y).w;
#else
    return filtered_box(y);
#endif
}
#endif

void main() {
    const vec2 from_centre_px = floor(gl_FragCoord.xy) - view.centre_px.xy;
    float length_mm;
    const float value = sample_of(ray_of(frame, from_centre_px), length_mm);
    line_integral = length_mm * scene.texel.x * value;
}
