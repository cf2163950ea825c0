// Structs that C++ and GLSL share: written by a shader, read here, member by member.

#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "backends/gl/programs.h"
#include "backends/gl/shared.h"
#include "gl_scenes.h"

namespace raylign::detail::gl {
namespace {

constexpr std::string_view kWriter = R"(#version 450
layout(local_size_x = 1) in;
#include "shared.glsl"
layout(std430, binding = 0) buffer Frames { FrameData frames[]; };
layout(std430, binding = 1) buffer Derivatives { DerivativeData derivatives[]; };
layout(std430, binding = 2) buffer Views { ViewData views[]; };
layout(std430, binding = 3) buffer Scenes { SceneData scenes[]; };
vec4 from(float first) { return first + vec4(0, 1, 2, 3); }
void main() {
    frames[1] = FrameData(from(1), from(5), from(9), from(13), uvec4(17, 18, 19, 20));
    for (int i = 0; i < 6; ++i) {
        derivatives[1].parameters[i] = ParameterData(from(100 * i), from(100 * i + 4), from(100 * i + 8), from(100 * i + 12));
    }
    views[1] = ViewData(uvec4(1, 2, 3, 4), from(5));
    scenes[1] = SceneData(from(1), from(5), from(9), uvec4(13, 14, 15, 16));
}
)";

template <class Struct>
Struct second_of(const Gl& gl, const Buffer& buffer) {
    std::array<Struct, 2> read;
    gl.GetNamedBufferSubData(buffer.id(), 0, sizeof(read), read.data());
    return read[1];
}

bool is(const shared::vec4& v, float first) {
    return v.x == first && v.y == first + 1 && v.z == first + 2 && v.w == first + 3;
}
bool is(const shared::uvec4& v, unsigned first) {
    return v.x == first && v.y == first + 1 && v.z == first + 2 && v.w == first + 3;
}

TEST(GlLayout, StructsOfShadersAreThoseOfTheHost) {
    RAYLIGN_NEED_GL(api);
    const auto context = open_device(api, {});
    const Current current(*context);
    const Gl& gl = context->gl();
    std::vector<ShaderFile> files(shader_files().begin(), shader_files().end());
    files.push_back({"writer.comp", kWriter});
    std::array<Buffer, 4> buffers;
    for (GLuint i = 0; i < 4; ++i) {
        buffers[i] = make_buffer(gl, "structs");
        gl.NamedBufferStorage(buffers[i].id(), 2048, nullptr, GL_DYNAMIC_STORAGE_BIT);
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, buffers[i].id());
    }
    gl.UseProgram(program(*context, {{"writer.comp"}, {}}, files));
    gl.DispatchCompute(1, 1, 1);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    context->wait("writing structs");

    const auto frame = second_of<shared::FrameData>(gl, buffers[0]);
    EXPECT_TRUE(is(frame.position_voxel, 1) && is(frame.direction_voxel, 5) && is(frame.step_u_voxel, 9));
    EXPECT_TRUE(is(frame.step_v_voxel, 13) && is(frame.view, 17u));
    const auto derivative = second_of<shared::DerivativeData>(gl, buffers[1]);
    for (int i = 0; i < 6; ++i) {
        const shared::ParameterData& p = derivative.parameters[i];
        EXPECT_TRUE(is(p.position_voxel, 100 * i) && is(p.direction_voxel, 100 * i + 4)) << i;
        EXPECT_TRUE(is(p.step_u_voxel, 100 * i + 8) && is(p.step_v_voxel, 100 * i + 12)) << i;
    }
    const auto view = second_of<shared::ViewData>(gl, buffers[2]);
    EXPECT_TRUE(is(view.size_px, 1u) && is(view.centre_px, 5));
    const auto scene = second_of<shared::SceneData>(gl, buffers[3]);
    EXPECT_TRUE(is(scene.volume_size, 1) && is(scene.spacing_mm, 5) && is(scene.texel, 9) && is(scene.counts, 13u));
    context->check("reading structs");
}

}  // namespace
}  // namespace raylign::detail::gl
