#pragma once

#define EGL_NO_X11
#define EGL_EGLEXT_PROTOTYPES
#define GL_GLEXT_PROTOTYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>

#include <string>

// The prototypes serve decltype only: nothing is linked, so that the program starts where no GL library is installed.

namespace raylign::detail::gl {

// clang-format off
#define RAYLIGN_EGL_FUNCTIONS(X) \
    X(GetError) X(QueryString) X(GetDisplay) X(Initialize) X(BindAPI) X(QueryAPI) X(ChooseConfig) X(CreateContext) \
    X(DestroyContext) X(MakeCurrent) X(GetCurrentContext) X(GetCurrentDisplay) X(GetCurrentSurface)
#define RAYLIGN_EGL_EXTENSIONS(X) \
    X(GetPlatformDisplayEXT) X(QueryDevicesEXT) X(QueryDeviceStringEXT)
#define RAYLIGN_GL_FUNCTIONS(X) \
    X(AttachShader) X(BeginQuery) X(BindBuffer) X(BindBufferBase) X(BindFramebuffer) X(BindImageTexture) X(BindTextureUnit) \
    X(BindVertexArray) X(BlendEquation) X(BlendFunc) X(ClearNamedFramebufferfv) X(ClientWaitSync) X(CompileShader) X(CopyImageSubData) X(CopyNamedBufferSubData) \
    X(CreateBuffers) X(CreateFramebuffers) X(CreateProgram) X(CreateQueries) X(CreateShader) X(CreateTextures) \
    X(CreateVertexArrays) X(DebugMessageCallback) X(DeleteBuffers) X(DeleteFramebuffers) X(DeleteProgram) \
    X(DeleteQueries) X(DeleteShader) X(DeleteSync) X(DeleteTextures) X(DeleteVertexArrays) X(Disable) X(DispatchCompute) X(DispatchComputeIndirect) X(DrawArrays) \
    X(DrawArraysInstanced) X(Enable) X(EndQuery) X(FenceSync) X(Finish) X(Flush) X(GenerateTextureMipmap) X(GetError) \
    X(GetGraphicsResetStatus) X(GetInteger64v) X(GetIntegeri_v) X(GetIntegerv) X(GetNamedBufferSubData) \
    X(GetProgramBinary) X(GetProgramInfoLog) X(GetProgramiv) X(GetQueryObjectui64v) X(GetShaderInfoLog) X(GetShaderiv) X(GetString) \
    X(GetStringi) X(GetTextureImage) X(LinkProgram) X(MapNamedBufferRange) X(MemoryBarrier) X(NamedBufferStorage) \
    X(NamedBufferSubData) X(NamedFramebufferDrawBuffer) X(NamedFramebufferDrawBuffers) X(NamedFramebufferTexture) X(ObjectLabel) X(PixelStorei) \
    X(PolygonMode) X(ProgramBinary) X(ProgramParameteri) X(ProgramUniform1f) X(ProgramUniform1i) X(ProgramUniform1ui) X(ProgramUniform2f) \
    X(ProgramUniform2i) X(ProgramUniform3f) X(ProgramUniform4f) X(ProgramUniformMatrix4fv) X(QueryCounter) \
    X(ReadPixels) X(Scissor) X(ShaderSource) X(TextureParameterfv) X(TextureParameteri) X(TextureStorage2D) \
    X(TextureStorage3D) X(TextureSubImage2D) X(TextureSubImage3D) X(UseProgram) X(Viewport)
// clang-format on

/// Functions of EGL and OpenGL, by their names without prefix. A table, so that tests can put a fault in one's place.
struct Api {
#define RAYLIGN_DECLARE(name) decltype(&::egl##name) name = nullptr;
    struct Egl {
        RAYLIGN_EGL_FUNCTIONS(RAYLIGN_DECLARE)
        RAYLIGN_EGL_EXTENSIONS(RAYLIGN_DECLARE)  // may be null
    } egl;
#undef RAYLIGN_DECLARE
#define RAYLIGN_DECLARE(name) decltype(&::gl##name) name = nullptr;
    struct Gl {
        RAYLIGN_GL_FUNCTIONS(RAYLIGN_DECLARE)
    } gl;
#undef RAYLIGN_DECLARE
};
using Gl = Api::Gl;

/// Opens the EGL library of this machine and looks up all functions. Throws Error, kind unavailable, naming the library
/// or the function that is missing. The library stays open until the process ends: drivers do not survive unloading.
[[nodiscard]] Api load_api(const std::string& library = "libEGL.so.1");

}  // namespace raylign::detail::gl
