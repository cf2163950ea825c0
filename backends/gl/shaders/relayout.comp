#version 450
// Copies the volume from the layers across one axis (or the 3-D texture) to those across another. In: source. Out: target.
// Work group: 8 x 8 texels of a layer of the target, z = layer.

layout(local_size_x = 8, local_size_y = 8) in;

#if FROM_BOX
layout(binding = 0) uniform sampler3D source;
#else
layout(binding = 0) uniform sampler2DArray source;
#endif
#if INT16
layout(binding = 0, r16) writeonly uniform image2DArray target;
#else
layout(binding = 0, r32f) writeonly uniform image2DArray target;
#endif

/// (in-plane, in-plane, layer) to (x, y, z), and back, where layers lie across `axis`.
ivec3 voxel_of(ivec3 at, int axis) { return axis == 0 ? at.zxy : axis == 1 ? at.xzy : at; }
ivec3 texel_of(ivec3 voxel, int axis) { return axis == 0 ? voxel.yzx : axis == 1 ? voxel.xzy : voxel; }

void main() {
    const ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, imageSize(target)))) return;
    imageStore(target, at, texelFetch(source, texel_of(voxel_of(at, TO_AXIS), FROM_AXIS), 0));
}
