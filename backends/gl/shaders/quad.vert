#version 450
// A quad over the whole viewport, once for each slice. Four vertices, a strip. Out: number of the slice.

layout(location = 0) flat out int slice;

void main() {
    slice = gl_InstanceID;
    gl_Position = vec4((gl_VertexID & 1) * 2 - 1, (gl_VertexID & 2) - 1, 0, 1);
}
