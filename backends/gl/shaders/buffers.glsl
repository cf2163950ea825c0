// All buffers, their bindings as in pipeline.cpp. At most eight storage buffers: the least that OpenGL 4.5 promises.

#include "shared.glsl"

const uint kParameters = 6;

layout(std140, binding = 0) uniform SceneBlock { SceneData scene; };
// Taps of the filter, x: smoothing, y: derivative; zeros after them (see strips.glsl).
layout(std140, binding = 1) uniform TapsBlock { vec4 taps[MAX_TAPS]; };

layout(std430, binding = 0) readonly buffer FrameBlock { FrameData frames[]; };
layout(std430, binding = 1) readonly buffer DerivativeBlock { DerivativeData derivatives[]; };
layout(std430, binding = 2) readonly buffer ViewBlock { ViewData views[]; };
layout(std430, binding = 3) buffer ImageBlock { float images[]; };       // [frame in work][image][y][x]
layout(std430, binding = 4) readonly buffer FixedBlock { vec4 fixed_pixels[]; };  // channel 0, channel 1, weight
layout(std430, binding = 5) buffer PartialBlock { double partials[]; };  // [frame in work][sum][block of pixels]
layout(std430, binding = 6) buffer SumBlock { double sums[]; };          // [frame][sum]
