// The volume: layers of 2-D textures across one axis each (those that rays step along), or a 3-D texture. Outside is zero:
// the border's colour is attenuation 0, so that the support is (-1, n) voxels. Values are in texel units, 0 = nothing.

layout(binding = 0) uniform sampler2DArray layers_x;  // (y, z) in layer x
layout(binding = 1) uniform sampler2DArray layers_y;  // (x, z) in layer y
layout(binding = 2) uniform sampler2DArray layers_z;  // (x, y) in layer z
layout(binding = 3) uniform sampler3D box;

/// The four texels around a point of a layer, (base, base + 1): x = (0, 1), y = (1, 1), z = (1, 0), w = (0, 0).
/// Asked for in their middle, where no rounding of the hardware can take another four.
vec4 corners(sampler2DArray layers, vec2 base, float layer) {
    return textureGather(layers, vec3((base + 1) / vec2(textureSize(layers, 0).xy), layer)) - scene.texel.y;
}

float bilinear(vec4 c, vec2 f) { return mix(mix(c.w, c.z, f.x), mix(c.x, c.y, f.x), f.y); }

/// Slopes of the bilinear interpolant along both axes of the layer.
vec2 slopes(vec4 c, vec2 f) { return vec2(mix(c.z - c.w, c.y - c.x, f.y), mix(c.x - c.w, c.y - c.z, f.x)); }

/// Corners in layers_z, which have no border along their own axis.
vec4 corners_z(vec2 base, float layer) {
    const vec4 c = corners(layers_z, base, layer);
    return layer >= 0 && layer < scene.volume_size.z ? c : vec4(0);
}

/// Gradient (xyz) and value (w) of the trilinear interpolant.
vec4 gradient_and_value(vec3 y) {
    const vec3 base = floor(y);
    const vec3 f = y - base;
    const vec4 low = corners_z(base.xy, base.z), high = corners_z(base.xy, base.z + 1);
    const float a = bilinear(low, f.xy), b = bilinear(high, f.xy);
    return vec4(mix(slopes(low, f.xy), slopes(high, f.xy), f.z), b - a, mix(a, b, f.z));
}

#if FILTER_BITS > 0
// As the texture units of GPUs filter, in the shader, where software OpenGL stands for one in a test.
vec2 fractions(vec2 f) { return floor(exp2(FILTER_BITS) * f + 0.5) / exp2(FILTER_BITS); }
float filtered(sampler2DArray layers, vec2 y, float layer) {
    const vec2 base = floor(y);
    return bilinear(corners(layers, base, layer), fractions(y - base));
}
float filtered_box(vec3 y) {
    const vec3 base = floor(y);
    const vec2 f = fractions(y.xy - base.xy);
    const float low = bilinear(corners_z(base.xy, base.z), f), high = bilinear(corners_z(base.xy, base.z + 1), f);
    return mix(low, high, fractions(vec2(y.z - base.z)).x);
}
#else
/// The value at a point of a layer, by the texture unit (8-bit fractions on GPUs).
float filtered(sampler2DArray layers, vec2 y, float layer) {
    return texture(layers, vec3((y + 0.5) / vec2(textureSize(layers, 0).xy), layer)).r - scene.texel.y;
}
/// The same anywhere in the volume.
float filtered_box(vec3 y) { return texture(box, (y + 0.5) / scene.volume_size.xyz).r - scene.texel.y; }
#endif
