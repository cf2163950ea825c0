#version 300 es
// The DRR of one view: core/CONVENTIONS.md, section 5, `trilinear`. Samples at distances (k + 1/2) step from the source; those before
// and after what a ray meets are left out (free.ts).
// In: the volume in 8 bit with one voxel of zeros around it, so that the filter falls to 0 as the padded lattice does.
// Out: the line integral of the ray through the centre of each pixel; row 0 of the target is row 0 of the image.
precision highp float;
precision highp sampler3D;
precision highp usampler3D;
uniform sampler3D u_volume;
uniform usampler3D u_free;
uniform vec3 u_source_voxel, u_size_voxels;
uniform mat3 u_voxel_from_camera, u_camera_from_pixel;
uniform float u_step_mm, u_depth_max_mm, u_per_mm, u_bin;
out vec4 result;

vec3 voxel_at(float k, vec3 ray) { return u_source_voxel + (k + 0.5) * u_step_mm * ray; }
// How many samples from here on, either way, meet nothing.
float leap_from(vec3 voxel, float samples_per_voxel) {
    float free = float(texelFetch(u_free, ivec3(voxel + 1.0) / BLOCK, 0).r);
    return free > 0.0 ? 1.0 + floor(max(0.0, (free - 1.0) * float(BLOCK) - 0.01) * samples_per_voxel) : 0.0;
}

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
    vec3 texture_from_voxel = 1.0 / (u_size_voxels + 2.0), along = abs(ray) * u_step_mm;
    float samples_per_voxel = 1.0 / max(along.x, max(along.y, along.z));
    // From both ends to what is there: the first sample, and the one after the last.
    float k = max(0.0, floor(begin / u_step_mm - 0.5)), last = ceil(end / u_step_mm - 0.5);
    for (float leap = 1.0; leap > 0.0 && k < last; k += leap) leap = leap_from(voxel_at(k, ray), samples_per_voxel);
    for (float leap = 1.0; leap > 0.0 && k < last; last -= leap) leap = leap_from(voxel_at(last - 1.0, ray), samples_per_voxel);
    float sum = 0.0;
    for (; k < last; k += 1.0) {
        vec3 voxel = voxel_at(k, ray);
        sum += textureLod(u_volume, (voxel + 1.5) * texture_from_voxel, 0.0).r;
    }
    result = vec4(sum * u_step_mm * u_per_mm, 0.0, 0.0, 1.0);
}
