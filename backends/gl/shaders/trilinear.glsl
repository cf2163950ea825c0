// Projector trilinear: midpoint rule at distances (k + 1/2) step from the source (core/CONVENTIONS.md, section 5).

float length_per_sample_mm(Ray ray) { return scene.volume_size.w; }

/// Samples of a ray: `count` of them, the first one at depth `start`.
struct Steps {
    float start, per_step;
    int count;
};

Steps steps_of(Ray ray) {
    Steps steps;
    steps.per_step = scene.volume_size.w / length(scene.spacing_mm.xyz * ray.direction);
    float begin = -ray.depth, end = ray.to_detector;
    for (int axis = 0; axis < 3; ++axis) {
        clip(ray.position[axis], ray.direction[axis], scene.volume_size[axis], begin, end);
    }
    // Steps are counted from the one before `position`, so that depths stay small.
    const float before = max(floor(ray.depth / steps.per_step), 0);
    const float zeroth = (before + 0.5) * steps.per_step - ray.depth;
    const float first = max(floor((begin - zeroth) / steps.per_step), -before);
    steps.start = zeroth + first * steps.per_step;
    steps.count = begin < end ? max(int(ceil((end - zeroth) / steps.per_step) - first), 0) : 0;
    return steps;
}

RaySums march_segment(Ray ray, Steps steps, int segment) {
    RaySums sums = RaySums(0, vec3(0), vec3(0));
    const int most = (steps.count + kSegments - 1) / kSegments, end = min((segment + 1) * most, steps.count);
    for (int k = segment * most; k < end; ++k) {
        const float depth = steps.start + float(k) * steps.per_step;
        const vec3 y = ray.position + depth * ray.direction;
#if EXACT || DERIVATIVES
        const vec4 g = gradient_and_value(y);
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

/// Every `parts`-th segment from `part` on.
RaySums march(Ray ray, int part, int parts) {
    const Steps steps = steps_of(ray);
    RaySums sums = march_segment(ray, steps, part);
    for (int i = part + parts; i < kSegments; i += parts) sums = plus(sums, march_segment(ray, steps, i));
    return sums;
}
