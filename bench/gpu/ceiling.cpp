#include "bench/gpu/ceiling.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>

#include "backends/gl/programs.h"
#include "backends/gl/scene_buffers.h"
#include "core/base/median.h"

namespace raylign::detail::bench {
namespace {

using namespace gl;

/// Layers met one after the other, slopes that differ little from pixel to pixel, as in joseph.glsl.
constexpr std::string_view kMarch = R"(#version 450
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0) uniform sampler2DArray layers;
layout(binding = 1) uniform sampler3D box;
layout(std430, binding = 0) writeonly buffer Out { float result[]; };
const vec2 n = vec2(VOXELS);
vec4 corners(vec2 base, int plane) { return textureGather(layers, vec3((base + 1) / n, plane)); }
float filtered(vec2 at, int plane) { return texture(layers, vec3((at + 0.5) / n, plane)).r; }
void main() {
    const float image = float(gl_WorkGroupID.z);
    const vec2 px = vec2(gl_GlobalInvocationID.xy) / SIDE;
    const vec2 middle = (0.7 * px + 0.15) * n + 5 * vec2(sin(image), cos(image));
    const vec2 slope = 0.25 * (px - 0.5) + vec2(0.1, -0.07) + 0.01 * image / 256;
    vec2 sum = vec2(0), slopes = vec2(0);
    for (int plane = 0; plane < VOXELS; plane += STEP) {
        vec2 at = middle + float(plane - VOXELS / 2) * slope;
#if FETCH == 0
        sum.x += filtered(at, plane);
#elif FETCH == 1
        float four[4];
        for (int i = 0; i < 4; ++i) four[i] = filtered(at + i * slope, plane + i);
        sum.x += (four[0] + four[1]) + (four[2] + four[3]);
#elif FETCH == 4
        sum.x += texture(box, (vec3(at, plane) + 0.5) / VOXELS).r;
#else
        const vec2 base = floor(at), f = at - base;
        const vec4 c = corners(base, plane);
#if FETCH == 3
        sum.x += filtered(at, plane);
#else
        sum.x += mix(mix(c.w, c.z, f.x), mix(c.x, c.y, f.x), f.y);
#endif
        const vec2 slope_here = vec2(mix(c.z - c.w, c.y - c.x, f.y), mix(c.x - c.w, c.y - c.z, f.x));
        sum.y += float(plane) * slope_here.x;
        slopes += slope_here;
#endif
    }
    const uint row = gl_WorkGroupID.z * uint(SIDE) + gl_GlobalInvocationID.y;
    result[row * uint(SIDE) + gl_GlobalInvocationID.x] = sum.x + sum.y + slopes.x + slopes.y;
}
)";
constexpr std::string_view kCopy = R"(#version 450
layout(local_size_x = 256) in;
layout(std430, binding = 0) readonly buffer In { vec4 from[]; };
layout(std430, binding = 1) writeonly buffer Out { vec4 to[]; };
void main() {
    const uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 256u + gl_LocalInvocationID.x;
    if (i < uint(from.length())) to[i] = 1.5 * from[i];
}
)";
constexpr std::string_view kNothing = R"(#version 450
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Out { float result[]; };
void main() { if (gl_GlobalInvocationID.x == 0u) result[0] += 1; }
)";
constexpr int kTurns = 5;

std::vector<ShaderFile> shaders() { return {{"march.comp", kMarch}, {"copy.comp", kCopy}, {"nothing.comp", kNothing}}; }

/// The least of several turns by timer queries, or by the clock where the device is software.
double least_s(Context& context, const std::function<void()>& work) {
    const Gl& gl = context.gl();
    const Query begin = make_query(gl, GL_TIMESTAMP, "begin"), end = make_query(gl, GL_TIMESTAMP, "end");
    double least = 1e300;
    for (int turn = 0; turn < kTurns; ++turn) {
        context.wait("measuring");
        const auto start = std::chrono::steady_clock::now();
        gl.QueryCounter(begin.id(), GL_TIMESTAMP);
        work();
        gl.QueryCounter(end.id(), GL_TIMESTAMP);
        context.wait("measuring");
        const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        GLuint64 from = 0, to = 0;
        gl.GetQueryObjectui64v(begin.id(), GL_QUERY_RESULT, &from);
        gl.GetQueryObjectui64v(end.id(), GL_QUERY_RESULT, &to);
        least = std::min(least, context.device().software ? wall_s : 1e-9 * static_cast<double>(to - from));
    }
    return least;
}

Texture noise(Context& context, GLenum target, const CeilingScene& scene) {
    const Gl& gl = context.gl();
    const int n = scene.voxels;
    std::vector<std::uint16_t> voxels(static_cast<std::size_t>(n) * n * n);
    std::uint32_t state = 1;
    for (std::uint16_t& voxel : voxels) {
        state = state * 1664525U + 1013904223U;
        voxel = static_cast<std::uint16_t>(state >> 16);
    }
    Texture texture = make_texture(gl, target, "noise");
    gl.TextureStorage3D(texture.id(), 1, scene.float_texels ? GL_R32F : GL_R16, n, n, n);
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.TextureSubImage3D(texture.id(), 0, 0, 0, 0, n, n, n, GL_RED, GL_UNSIGNED_SHORT, voxels.data());
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
        gl.TextureParameteri(texture.id(), wrap, GL_CLAMP_TO_BORDER);
    }
    gl.TextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl.TextureParameteri(texture.id(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    context.check("uploading noise");
    return texture;
}

}  // namespace

std::string_view fetch_name(Fetch fetch) {
    constexpr std::string_view kNames[] = {"texture", "texture, four planes at a time", "gather, value and slopes",
                                           "gather and texture", "3-D texture"};
    return kNames[static_cast<int>(fetch)];
}

double samples_per_s(Context& context, Fetch fetch, const CeilingScene& scene) {
    const Gl& gl = context.gl();
    const bool box = fetch == Fetch::texture_3d;
    const Texture volume = noise(context, box ? GL_TEXTURE_3D : GL_TEXTURE_2D_ARRAY, scene);
    const std::size_t pixels = static_cast<std::size_t>(scene.side_px) * scene.side_px * scene.images;
    const Buffer out = make_storage(context, "result", sizeof(float) * pixels);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, out.id());
    gl.BindTextureUnit(box ? 1 : 0, volume.id());
    const GLuint march = program(context,
                                 {{"march.comp"},
                                  {{"VOXELS", scene.voxels},
                                   {"SIDE", scene.side_px},
                                   {"FETCH", static_cast<int>(fetch)},
                                   {"STEP", fetch == Fetch::texture_four ? 4 : 1}}},
                                 shaders());
    gl.UseProgram(march);
    const auto groups = static_cast<GLuint>(scene.side_px / 8);
    const double s = least_s(context, [&] {
        gl.DispatchCompute(groups, groups, static_cast<GLuint>(scene.images));
        gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    });
    return static_cast<double>(pixels) * scene.voxels / s;
}

double copied_bytes_per_s(Context& context, std::size_t bytes) {
    const Gl& gl = context.gl();
    const Buffer from = make_storage(context, "from", bytes), to = make_storage(context, "to", bytes);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, from.id());
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, to.id());
    gl.UseProgram(program(context, {{"copy.comp"}, {}}, shaders()));
    const auto groups = static_cast<GLuint>((bytes / 16 + 255) / 256);
    constexpr GLuint kRow = 16384;
    const double s = least_s(context, [&] {
        gl.DispatchCompute(std::min(groups, kRow), (groups + kRow - 1) / kRow, 1);
        gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    });
    return 2 * static_cast<double>(bytes) / s;
}

double round_trip_s(Context& context) {
    const Gl& gl = context.gl();
    const Buffer out = make_storage(context, "result", 16);
    gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, out.id());
    gl.UseProgram(program(context, {{"nothing.comp"}, {}}, shaders()));
    std::vector<double> times_s;
    for (int turn = 0; turn < 60; ++turn) {
        const auto start = std::chrono::steady_clock::now();
        gl.DispatchCompute(1, 1, 1);
        context.wait("measuring");
        times_s.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    return median(times_s);
}

}  // namespace raylign::detail::bench
