#pragma once

#include <string_view>
#include <utility>

#include "backends/gl/api.h"

namespace raylign::detail::gl {

/// Owns one OpenGL object; moves, never copies. Its context must be current when it goes. `deleter`: the function of
/// the table that deletes such objects; `type`: their kind for labels, e.g. GL_BUFFER.
template <auto deleter, GLenum type>
class Handle {
public:
    Handle() = default;
    Handle(const Gl& gl, GLuint id, std::string_view label) : gl_(&gl), id_(id) {
        if (id_ != 0) gl.ObjectLabel(type, id_, static_cast<GLsizei>(label.size()), label.data());
    }
    Handle(Handle&& other) noexcept : gl_(other.gl_), id_(std::exchange(other.id_, 0)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(gl_, other.gl_);
        std::swap(id_, other.id_);
        return *this;
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    ~Handle() {
        if (id_ == 0) return;
        if constexpr (type == GL_PROGRAM || type == GL_SHADER) {
            (gl_->*deleter)(id_);
        } else {
            (gl_->*deleter)(1, &id_);
        }
    }

    [[nodiscard]] GLuint id() const { return id_; }
    explicit operator bool() const { return id_ != 0; }

private:
    const Gl* gl_ = nullptr;
    GLuint id_ = 0;
};

/// Owns a fence in the queue of commands; none where the context is lost.
class Fence {
public:
    Fence(const Gl& gl, GLsync sync) : gl_(&gl), sync_(sync) {}
    Fence(Fence&& other) noexcept : gl_(other.gl_), sync_(std::exchange(other.sync_, nullptr)) {}
    Fence& operator=(Fence&& other) noexcept {
        std::swap(gl_, other.gl_);
        std::swap(sync_, other.sync_);
        return *this;
    }
    Fence(const Fence&) = delete;
    Fence& operator=(const Fence&) = delete;
    ~Fence() {
        if (sync_ != nullptr) gl_->DeleteSync(sync_);
    }

    [[nodiscard]] GLsync sync() const { return sync_; }

private:
    const Gl* gl_;
    GLsync sync_;
};

using Buffer = Handle<&Gl::DeleteBuffers, GL_BUFFER>;
using Texture = Handle<&Gl::DeleteTextures, GL_TEXTURE>;
using Framebuffer = Handle<&Gl::DeleteFramebuffers, GL_FRAMEBUFFER>;
using VertexArray = Handle<&Gl::DeleteVertexArrays, GL_VERTEX_ARRAY>;
using Query = Handle<&Gl::DeleteQueries, GL_QUERY>;
using Shader = Handle<&Gl::DeleteShader, GL_SHADER>;
using Program = Handle<&Gl::DeleteProgram, GL_PROGRAM>;

[[nodiscard]] inline Buffer make_buffer(const Gl& gl, std::string_view label) {
    GLuint id = 0;
    gl.CreateBuffers(1, &id);
    return {gl, id, label};
}
[[nodiscard]] inline Texture make_texture(const Gl& gl, GLenum target, std::string_view label) {
    GLuint id = 0;
    gl.CreateTextures(target, 1, &id);
    return {gl, id, label};
}
[[nodiscard]] inline Framebuffer make_framebuffer(const Gl& gl, std::string_view label) {
    GLuint id = 0;
    gl.CreateFramebuffers(1, &id);
    return {gl, id, label};
}
[[nodiscard]] inline VertexArray make_vertex_array(const Gl& gl, std::string_view label) {
    GLuint id = 0;
    gl.CreateVertexArrays(1, &id);
    return {gl, id, label};
}
[[nodiscard]] inline Query make_query(const Gl& gl, GLenum target, std::string_view label) {
    GLuint id = 0;
    gl.CreateQueries(target, 1, &id);
    return {gl, id, label};
}

}  // namespace raylign::detail::gl
