// Projector joseph: the lattice planes of the ray's longest axis, bilinear in-plane (core/CONVENTIONS.md, section 5).

const float kAxisBias = 1e-5;  // as dominant_axis() in core

int dominant_axis(vec3 ray) {
    const vec3 len = abs(ray);
    const int axis = len.y > len.x * (1 + kAxisBias) ? 1 : 0;
    return len.z > len[axis] * (1 + kAxisBias) ? 2 : axis;
}

/// Planes of one axis: where the ray meets them, in-plane, and which of them count.
struct Planes {
    vec2 at;      // in-plane position at plane `start`, which need not be whole
    vec2 slope;   // in-plane, per plane
    float start, depth_per_plane;
    int first, end;
};

Planes planes_of(Ray ray, int axis) {
    const ivec2 others = axis == 0 ? ivec2(1, 2) : axis == 1 ? ivec2(0, 2) : ivec2(0, 1);
    const float along = ray.direction[axis];
    Planes p;
    p.start = ray.position[axis];
    p.at = vec2(ray.position[others.x], ray.position[others.y]);
    p.slope = vec2(ray.direction[others.x], ray.direction[others.y]) / along;
    p.depth_per_plane = 1 / along;
    // Strictly between source and detector.
    const float source = p.start - ray.depth * along, detector = p.start + ray.to_detector * along;
    const float lowest = max(0, floor(min(source, detector)) + 1);
    const float highest = min(scene.volume_size[axis] - 1, ceil(max(source, detector)) - 1);
    float first = lowest - p.start, last = highest - p.start;
    clip(p.at.x, p.slope.x, scene.volume_size[others.x], first, last);
    clip(p.at.y, p.slope.y, scene.volume_size[others.y], first, last);
    // Rounding must not lose a plane: those outside bring nothing. A ray almost parallel to a side of the volume meets it
    // where no int reaches.
    p.first = int(min(max(lowest, floor(first + p.start)), max(lowest, highest + 1)));
    p.end = max(p.first, int(max(lowest - 1, min(highest, ceil(last + p.start)))) + 1);
    return p;
}

/// Adds up the samples of some of one axis' layers.
void march_layers(sampler2DArray layers, Planes p, inout float value, inout vec2 g0, inout vec2 g1) {
    for (int plane = p.first; plane < p.end; ++plane) {
        const float from_start = float(plane) - p.start;
        const vec2 y = p.at + from_start * p.slope;
        // Where the four voxels are read anyway for their slopes, the value comes from them, too.
#if EXACT || DERIVATIVES
        const vec2 base = floor(y);
        const vec4 c = corners(layers, base, plane);
        value += bilinear(c, y - base);
#else
        value += filtered(layers, y, plane);
#endif
#if DERIVATIVES
        const vec2 g = slopes(c, y - base);
        g0 += g;
        g1 += from_start * p.depth_per_plane * g;
#endif
    }
}

Planes segment_of(Planes p, int segment) {
    const int most = (p.end - p.first + kSegments - 1) / kSegments, first = p.first + segment * most;
    p.end = min(first + most, p.end);
    p.first = first;
    return p;
}

/// The component of g0 and g1 along the axis stays 0: it cancels from the derivative of a sample in its plane.
RaySums march_segment(Planes p, int axis) {
    float value = 0;
    vec2 g0 = vec2(0), g1 = vec2(0);
    const int end = p.end;  // rays of other axes have no planes here
    p.end = axis == 0 ? end : p.first;
    march_layers(layers_x, p, value, g0, g1);
    p.end = axis == 1 ? end : p.first;
    march_layers(layers_y, p, value, g0, g1);
    p.end = axis == 2 ? end : p.first;
    march_layers(layers_z, p, value, g0, g1);
    const vec3 h0 = axis == 0 ? vec3(0, g0) : axis == 1 ? vec3(g0.x, 0, g0.y) : vec3(g0, 0);
    const vec3 h1 = axis == 0 ? vec3(0, g1) : axis == 1 ? vec3(g1.x, 0, g1.y) : vec3(g1, 0);
    return RaySums(value, h0, h1);
}

/// Every `parts`-th segment from `part` on.
RaySums march(Ray ray, int part, int parts) {
    const int axis = dominant_axis(ray.direction);
    const Planes p = planes_of(ray, axis);
    RaySums sums = march_segment(segment_of(p, part), axis);
    for (int i = part + parts; i < kSegments; i += parts) sums = plus(sums, march_segment(segment_of(p, i), axis));
    return sums;
}

float length_per_sample_mm(Ray ray) {
    return abs(1 / ray.direction[dominant_axis(ray.direction)]) * length(scene.spacing_mm.xyz * ray.direction);
}
