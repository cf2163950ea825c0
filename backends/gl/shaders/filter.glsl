// Second pass of the gradient filter, down the columns, in strips of four pixels: x = dI/dx, y = dI/dy.

layout(location = 4) uniform uint smoothed_rows;  // where those begin in rows

/// Four pixels of a column from (x, y) down, of channel 0 or 1. `image`: in work. Without GRADIENT: the image itself.
vec4 strip_of(uint image, ivec2 at, ivec2 size, int channel) {
    const uint first = image * scene.counts.x + at.x;
    vec4 strip = vec4(0);
#if GRADIENT
    const uint row = first + channel * smoothed_rows;
    const int radius = int(scene.counts.w);
    for (int k = -radius; k < radius + 4; ++k) {  // borders repeat the nearest pixel
        const float value = rows[row + clamp(at.y + k, 0, size.y - 1) * size.x];
        const int tap = k + radius + 3;
        strip += value * vec4(taps[tap][channel], taps[tap - 1][channel], taps[tap - 2][channel], taps[tap - 3][channel]);
    }
#else
    for (int i = 0; i < 4 && at.y + i < size.y; ++i) strip[i] = images[first + (at.y + i) * size.x];
#endif
    return strip;
}

/// Fixed images and weights of the same pixels; weight 0 below the image.
void fixed_strip(ViewData view, ivec2 at, out vec4 fixed_0, out vec4 fixed_1, out vec4 weights) {
    fixed_0 = fixed_1 = weights = vec4(0);
    for (int i = 0; i < 4 && at.y + i < int(view.size_px.y); ++i) {
        const vec4 pixel = fixed_pixels[view.size_px.z + (at.y + i) * view.size_px.x + at.x];
        fixed_0[i] = pixel.x;
        fixed_1[i] = pixel.y;
        weights[i] = pixel.z;
    }
}
