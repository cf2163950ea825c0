#pragma once

#include <cstdint>

namespace raylign::detail::gl::shared {

/// What GLSL calls by the same names.
struct alignas(16) vec4 {
    float x = 0, y = 0, z = 0, w = 0;
};
struct alignas(16) uvec4 {
    std::uint32_t x = 0, y = 0, z = 0, w = 0;
};

#include "backends/gl/shaders/shared.glsl"

static_assert(sizeof(FrameData) == 80 && sizeof(DerivativeData) == 384);
static_assert(sizeof(ViewData) == 32 && sizeof(SceneData) == 64);

}  // namespace raylign::detail::gl::shared
