#version 300 es
// The DRR of one view: core/CONVENTIONS.md, section 5, `trilinear`. Samples at distances (k + 1/2) step from the source.
// In: the volume in 8 bit with one voxel of zeros around it, so that the filter falls to 0 as the padded lattice does.
// Out: the line integral of the ray through the centre of each pixel; row 0 of the target is row 0 of the image.
precision highp float;
precision highp sampler3D;
uniform sampler3D u_volume;
uniform vec3 u_source_voxel, u_size_voxels;
uniform mat3 u_voxel_from_camera, u_camera_from_pixel;
uniform float u_step_mm, u_depth_max_mm, u_per_mm, u_bin;
out vec4 result;

void main() {
    vec2 pixel = gl_FragCoord.xy * u_bin - 0.5;
    vec3 ray_mm = u_camera_from_pixel * vec3(pixel, 1.0);
    float length_per_depth = length(ray_mm);
    vec3 ray = u_voxel_from_camera * (ray_mm / length_per_depth);
    ray = mix(ray, vec3(1e-9), lessThan(abs(ray), vec3(1e-9)));
    vec3 a = (vec3(-1.0) - u_source_voxel) / ray, b = (u_size_voxels - u_source_voxel) / ray;
    vec3 nearest = min(a, b), farthest = max(a, b);
    float begin = max(0.0, max(nearest.x, max(nearest.y, nearest.z)));
    float end = min(u_depth_max_mm * length_per_depth, min(farthest.x, min(farthest.y, farthest.z)));
    float first = max(0.0, floor(begin / u_step_mm - 0.5));
    vec3 texture_from_voxel = 1.0 / (u_size_voxels + 2.0);
    float sum = 0.0;
    for (float k = 0.0; k < 4096.0; k += 1.0) {
        float distance_mm = (first + k + 0.5) * u_step_mm;
        if (!(distance_mm < end)) break;
        vec3 voxel = u_source_voxel + distance_mm * ray;
        sum += texture(u_volume, (voxel + 1.5) * texture_from_voxel).r;
    }
    result = vec4(sum * u_step_mm * u_per_mm, 0.0, 0.0, 1.0);
}
