// The gradient filter of a tile of 16 x 64 pixels within a work group: rows along x into shared memory, then columns from there. To
// be included after kSumFloats, what else the shared memory must hold.

const int kStrip = 8, kColumns = 16, kStripsDown = 8, kRows = kStrip * kStripsDown, kLanes = kColumns * kStripsDown;
const int kPitch = kColumns + 2;  // so that rows begin in different banks
const int kMostRows = kRows + 2 * MOST_RADIUS, kRowFloats = 2 * GRADIENT * kMostRows * kPitch;
layout(local_size_x = kColumns, local_size_y = kStripsDown) in;
shared float scratch[max(kRowFloats, kSumFloats)];

/// Eight pixels, of a row or (each invocation's own) down a column.
struct Strip {
    vec4 upper, lower;
};

const Strip kNothing = Strip(vec4(0), vec4(0));
Strip times(Strip a, Strip b) { return Strip(a.upper * b.upper, a.lower * b.lower); }
float sum_of(Strip a, Strip b) { return dot(a.upper, b.upper) + dot(a.lower, b.lower); }

#if GRADIENT
/// One more value for the eight pixels: `near` has their taps, which move on by one.
void take(float value, float tap, inout Strip near, inout Strip strip) {
    near.lower = vec4(near.upper.w, near.lower.xyz);
    near.upper = vec4(tap, near.upper.xyz);
    strip.upper += value * near.upper;
    strip.lower += value * near.lower;
}
void keep(Strip strip, int at) {
    for (int i = 0; i < 4; ++i) {
        scratch[at + i] = strip.upper[i];
        scratch[at + 4 + i] = strip.lower[i];
    }
}

/// The rows that the tile's columns need, both channels. `first`: of the image. Borders repeat the nearest pixel.
void filter_rows(uint first, ivec2 corner, ivec2 size) {
    const int radius = int(scene.counts.w), strips = kColumns / kStrip;
    for (int i = int(gl_LocalInvocationIndex); i < (kRows + 2 * radius) * strips; i += kLanes) {
        const int row = i / strips, x = i % strips * kStrip;
        const uint from = first + clamp(corner.y + row - radius, 0, size.y - 1) * size.x;
        Strip derivative = kNothing, smoothed = kNothing, near_derivative = kNothing, near_smoothed = kNothing;
        for (int k = 0; k < 2 * radius + kStrip; ++k) {
            const float value = images[from + clamp(corner.x + x + k - radius, 0, size.x - 1)];
            const vec2 tap = taps[k].xy;
            take(value, tap.y, near_derivative, derivative);
            take(value, tap.x, near_smoothed, smoothed);
        }
        keep(derivative, row * kPitch + x);
        keep(smoothed, (kMostRows + row) * kPitch + x);
    }
}

/// The invocation's strip of a channel, from the rows.
Strip filter_column(int channel) {
    const int radius = int(scene.counts.w);
    const int at = (channel * kMostRows + int(gl_LocalInvocationID.y) * kStrip) * kPitch + int(gl_LocalInvocationID.x);
    Strip strip = kNothing, near = kNothing;
    for (int k = 0; k < 2 * radius + kStrip; ++k) take(scratch[at + k * kPitch], taps[k][channel], near, strip);
    return strip;
}
#else
/// The invocation's strip of the image that begins at `first`.
Strip strip_of(uint first, ivec2 at, ivec2 size) {
    Strip strip = kNothing;
    for (int i = 0; i < kStrip && at.x < size.x && at.y + i < size.y; ++i) {
        const float value = images[first + (at.y + i) * size.x + at.x];
        if (i < 4) strip.upper[i] = value;
        else strip.lower[i - 4] = value;
    }
    return strip;
}
#endif
