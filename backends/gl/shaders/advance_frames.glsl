// Frames of a pose and their derivatives (core/geometry/ray_frame.cpp), as the passes over them read them (frame_data.cpp).

/// As RayFrame, in voxel coordinates: source and columns of direction [1/mm of depth].
struct Frame {
    dmat3 voxel_from_world;  // rotation and scale
    dvec3 source, step_u, step_v, direction;
};

Frame frame_of(uint search, uint v) {
    const dmat3 ct_from_world = transpose(rotation_of(searches[search].trial));
    const dmat3 voxel_from_ct = matrix_of(descent.voxel_from_ct);
    Frame frame;
    frame.voxel_from_world = voxel_from_ct * ct_from_world;
    const dvec3 source_ct = ct_from_world * (vector_of(cameras[v].source) - shift_of(searches[search].trial));
    frame.source = voxel_from_ct * (source_ct - vector_of(descent.origin_ct));
    const dmat3 columns = frame.voxel_from_world * matrix_of(cameras[v].world_from_pixel);
    frame.step_u = columns[0];
    frame.step_v = columns[1];
    frame.direction = columns[2];
    return frame;
}

/// Bit n: axis n may be the longest one of a ray of the trial pose. `can_be_seen`: rays can be made for it.
uint axes_met(uint search, out bool can_be_seen) {
    uint possible = 0;
    can_be_seen = true;
    for (uint v = 0; v < descent.views; ++v) {
        const Frame frame = frame_of(search, v);
        const double farthest = max(abs(frame.source.x), max(abs(frame.source.y), abs(frame.source.z)));
        if (isnan(frame.source.x + frame.source.y + frame.source.z) || !(farthest <= descent.farthest_source)) can_be_seen = false;
        dvec3 low = frame.direction, high = low;
        for (int corner = 1; corner < 4; ++corner) {
            const dvec3 ray = frame.direction + double((corner & 1) * int(views[v].size_px.x - 1)) * frame.step_u +
                              double((corner >> 1) * int(views[v].size_px.y - 1)) * frame.step_v;
            low = min(low, ray);
            high = max(high, ray);
        }
        const dvec3 longest = max(abs(low), abs(high)), shortest = max(max(low, -high), dvec3(0));
        const double most = max(shortest.x, max(shortest.y, shortest.z));
        for (int axis = 0; axis < 3; ++axis) {
            if (!(most > longest[axis] * (1 + descent.axis_bias))) possible |= 1u << axis;
        }
    }
    return possible;
}

vec4 vec4_of(dvec3 xyz, double w) { return vec4(vec3(xyz), float(w)); }

void write_frame(uint search, uint v, uint at) {
    const Frame frame = frame_of(search, v);
    const dvec2 px = (dvec2(views[v].size_px.xy) - 1) / 2;
    const dvec3 ray = frame.direction + px.x * frame.step_u + px.y * frame.step_v;
    const dvec3 middle = vector_of(descent.first_voxel) + (vector_of(descent.size_voxels) - 1) / 2;
    const double depth = dot(middle - frame.source, ray) / dot(ray, ray);
    frames[at] = FrameData(vec4_of(frame.source + depth * ray - vector_of(descent.first_voxel), depth),
                           vec4_of(ray, min(cameras[v].depth_max - depth, kFarAway_mm)), vec4_of(frame.step_u, 0),
                           vec4_of(frame.step_v, 0), uvec4(v, floatBitsToUint(float(cameras[v].ceiling)), 0, 0));
    const dvec3 centre = rotation_of(searches[search].trial) * vector_of(descent.centre_ct) + shift_of(searches[search].trial);
    const dvec3 arm = vector_of(cameras[v].source) - centre;
    const dmat3 world_from_pixel = matrix_of(cameras[v].world_from_pixel);
    for (int i = 0; i < 3; ++i) {
        dvec3 axis = dvec3(0);
        axis[i] = 1;
        const dvec3 source = -(frame.voxel_from_world * cross(axis, arm));
        const dvec3 step_u = -(frame.voxel_from_world * cross(axis, world_from_pixel[0]));
        const dvec3 step_v = -(frame.voxel_from_world * cross(axis, world_from_pixel[1]));
        const dvec3 turn = -(frame.voxel_from_world * cross(axis, world_from_pixel[2])) + px.x * step_u + px.y * step_v;
        derivatives[at].parameters[i] =
            ParameterData(vec4_of(source + depth * turn, 0), vec4_of(turn, 0), vec4_of(step_u, 0), vec4_of(step_v, 0));
        derivatives[at].parameters[3 + i] =
            ParameterData(vec4_of(-(frame.voxel_from_world * axis), 0), vec4(0), vec4(0), vec4(0));
    }
}

/// Those that look at `count` frames, pass by pass of each chunk (pipeline_passes.cpp).
void write_groups(uint count) {
    for (uint c = 0; c < descent.chunks; ++c) {
        const uint before = c * descent.chunk_frames;
        const uint own = count > before ? min(count - before, descent.chunk_frames) : 0;
        const uint x[3] = uint[3](descent.cast_groups[0], descent.sums_groups[0], descent.channels * kSums);
        const uint y[3] = uint[3](descent.cast_groups[1], descent.sums_groups[1], 1);
        for (uint pass = 0; pass < 3; ++pass) {
            groups[9 * c + 3 * pass] = x[pass];
            groups[9 * c + 3 * pass + 1] = y[pass];
            groups[9 * c + 3 * pass + 2] = own;
        }
    }
}
