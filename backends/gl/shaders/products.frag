#version 450
// The five sums of one channel over SIDE x SIDE pixels: the first step of a reduction (SIDE 3), or the pixels themselves (SIDE 1,
// for mipmaps). In: moving channels, fixed channels and weights. Out: (w A, w A^2, w B, w B^2) and w A B: four of five in one
// target [Ino06].

layout(binding = 4) uniform sampler2D moving;
layout(binding = 5) uniform sampler2D fixed_pixels;  // channel 0, channel 1, weight
layout(location = 0) uniform int channel;

layout(location = 0) out vec4 four;
layout(location = 1) out float fifth;

void main() {
    const ivec2 first = SIDE * ivec2(gl_FragCoord.xy), size = textureSize(moving, 0);
    four = vec4(0);
    fifth = 0;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const ivec2 at = first + ivec2(i % SIDE, i / SIDE);
        if (any(greaterThanEqual(at, size))) continue;
        const vec4 pixel = texelFetch(fixed_pixels, at, 0);
        const float a = pixel[channel], b = texelFetch(moving, at, 0)[channel];
        four += pixel.z * vec4(a, a * a, b, b * b);
        fifth += pixel.z * a * b;
    }
}
