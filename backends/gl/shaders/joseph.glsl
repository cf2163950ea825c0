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
    float start, depth_per_plane, first, last;
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
    p.first = max(0, floor(min(source, detector)) + 1);
    p.last = min(scene.volume_size[axis] - 1, ceil(max(source, detector)) - 1);
    float first = p.first - p.start, last = p.last - p.start;
    clip(p.at.x, p.slope.x, scene.volume_size[others.x], first, last);
    clip(p.at.y, p.slope.y, scene.volume_size[others.y], first, last);
    // Rounding must not lose a plane: those outside bring nothing.
    p.first = max(p.first, floor(first + p.start));
    p.last = min(p.last, ceil(last + p.start));
    return p;
}

/// Adds up the samples of one axis' layers. Rays of other axes have no planes here.
void march_layers(sampler2DArray layers, Planes p, inout float value, inout vec2 g0, inout vec2 g1) {
    for (float plane = p.first; plane <= p.last; plane += 1) {
        const float from_start = plane - p.start;
        const vec2 y = p.at + from_start * p.slope;
#if EXACT || DERIVATIVES
        const vec2 base = floor(y);
        const vec4 c = corners(layers, base, plane);
#endif
#if EXACT
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

/// The component of g0 and g1 along the axis stays 0: it cancels from the derivative of a sample in its plane.
RaySums march(Ray ray, out float length_mm) {
    const int axis = dominant_axis(ray.direction);
    Planes p = planes_of(ray, axis);
    const float last = p.last;
    float value = 0;
    vec2 g0 = vec2(0), g1 = vec2(0);
    p.last = axis == 0 ? last : -1;
    march_layers(layers_x, p, value, g0, g1);
    p.last = axis == 1 ? last : -1;
    march_layers(layers_y, p, value, g0, g1);
    p.last = axis == 2 ? last : -1;
    march_layers(layers_z, p, value, g0, g1);
    length_mm = abs(p.depth_per_plane) * length(scene.spacing_mm.xyz * ray.direction);
    const vec3 h0 = axis == 0 ? vec3(0, g0) : axis == 1 ? vec3(g0.x, 0, g0.y) : vec3(g0, 0);
    const vec3 h1 = axis == 0 ? vec3(0, g1) : axis == 1 ? vec3(g1.x, 0, g1.y) : vec3(g1, 0);
    return RaySums(value, h0, h1);
}
