#version 450
// First pass of the gradient filter, along x. In: image. Out: r = derivative, g = smoothed.

#include "buffers.glsl"

layout(binding = 4) uniform sampler2D image;
layout(location = 0) out vec2 filtered;

void main() {
    const ivec2 at = ivec2(gl_FragCoord.xy);
    const int last = textureSize(image, 0).x - 1, radius = int(scene.counts.w);
    filtered = vec2(0);
    for (int k = -radius; k <= radius; ++k) {  // borders repeat the nearest pixel
        filtered += taps[k + radius].yx * texelFetch(image, ivec2(clamp(at.x + k, 0, last), at.y), 0).r;
    }
}
