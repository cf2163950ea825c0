#version 450
// One step of a reduction: 3 x 3 texels to 1 [Ino06]. With MIPMAP: the last level of a mipmap, times the number of texels that
// it is the mean of [Chisu05]. In and out: as products.frag.

layout(binding = 4) uniform sampler2D fours;
layout(binding = 5) uniform sampler2D fifths;
layout(location = 1) uniform ivec2 size;  // of what is reduced: the textures may be larger
layout(location = 2) uniform int level;

layout(location = 0) out vec4 four;
layout(location = 1) out float fifth;

void main() {
#if MIPMAP
    const vec2 whole = vec2(textureSize(fours, 0));
    four = whole.x * whole.y * texelFetch(fours, ivec2(0), level);
    fifth = whole.x * whole.y * texelFetch(fifths, ivec2(0), level).r;
#else
    // The last step's one pixel may lie anywhere in its target.
    const ivec2 first = size.x > 3 || size.y > 3 ? 3 * ivec2(gl_FragCoord.xy) : ivec2(0);
    four = vec4(0);
    fifth = 0;
    for (int i = 0; i < 9; ++i) {
        const ivec2 at = first + ivec2(i % 3, i / 3);
        if (any(greaterThanEqual(at, size))) continue;
        four += texelFetch(fours, at, 0);
        fifth += texelFetch(fifths, at, 0).r;
    }
#endif
}
