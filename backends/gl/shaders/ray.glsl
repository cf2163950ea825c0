// The ray of a pixel, and what is summed along it.

struct Ray {
    vec3 position;     // at depth 0 of the frame's own count (see FrameData) [voxel]
    vec3 direction;    // per mm of depth
    float depth;       // of `position` from the source [mm]
    float to_detector; // [mm] of depth from `position`
};

/// Sums over samples: of the value, of its gradient, and of depth (counted from `position`) times gradient.
struct RaySums {
    float value;
    vec3 g0, g1;
};

/// Each ray is summed in this many segments, first to last; invocations of a work group may share them out.
const int kSegments = 4;

RaySums plus(RaySums a, RaySums b) { return RaySums(a.value + b.value, a.g0 + b.g0, a.g1 + b.g1); }

Ray ray_of(FrameData frame, vec2 from_centre_px) {
    const vec3 turn = from_centre_px.x * frame.step_u_voxel.xyz + from_centre_px.y * frame.step_v_voxel.xyz;
    return Ray(frame.position_voxel.xyz + frame.position_voxel.w * turn, frame.direction_voxel.xyz + turn,
               frame.position_voxel.w, frame.direction_voxel.w);
}

/// First and last depth inside (-1, size) along some axes; first > last where there is none. A component of zero (0 x inf
/// must not decide) is inside everywhere or nowhere.
void clip(float at, float slope, float size, inout float first, inout float last) {
    if (abs(slope) < 1e-12) {
        if (!(at > -1 && at < size)) last = first - 1;
        return;
    }
    const float a = (-1 - at) / slope, b = (size - at) / slope;
    first = max(first, min(a, b));
    last = min(last, max(a, b));
}
