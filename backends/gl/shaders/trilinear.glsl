// Projector trilinear: midpoint rule at distances (k + 1/2) step from the source (core/CONVENTIONS.md, section 5).

RaySums march(Ray ray, out float length_mm) {
    length_mm = scene.volume_size.w;
    const float per_step = length_mm / length(scene.spacing_mm.xyz * ray.direction);
    float begin = -ray.depth, end = ray.to_detector;
    for (int axis = 0; axis < 3; ++axis) {
        clip(ray.position[axis], ray.direction[axis], scene.volume_size[axis], begin, end);
    }
    RaySums sums = RaySums(0, vec3(0), vec3(0));
    if (!(begin < end)) return sums;
    // Steps are counted from the one before `position`, so that depths stay small.
    const float before = max(floor(ray.depth / per_step), 0);
    const float start = (before + 0.5) * per_step - ray.depth;
    const float first = max(floor((begin - start) / per_step), -before);
    for (float k = first; start + k * per_step < end; k += 1) {
        const float depth = start + k * per_step;
        const vec3 y = ray.position + depth * ray.direction;
#if EXACT || DERIVATIVES
        const vec4 g = gradient_and_value(y);
#endif
#if EXACT
        sums.value += g.w;
#else
        sums.value += filtered_box(y);
#endif
#if DERIVATIVES
        sums.g0 += g.xyz;
        sums.g1 += depth * g.xyz;
#endif
    }
    return sums;
}
