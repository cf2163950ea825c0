#version 450
// Second pass, along y: both gradients at once, packed in two channels [Ino06]. In: rows. Out: r = dI/dx, g = dI/dy.

#include "buffers.glsl"

layout(binding = 4) uniform sampler2D image;
layout(location = 0) out vec2 gradients;

void main() {
    const ivec2 at = ivec2(gl_FragCoord.xy);
    const int last = textureSize(image, 0).y - 1, radius = int(scene.counts.w);
    gradients = vec2(0);
    for (int k = -radius; k <= radius; ++k) {
        gradients += taps[k + radius].xy * texelFetch(image, ivec2(at.x, clamp(at.y + k, 0, last)), 0).rg;
    }
}
