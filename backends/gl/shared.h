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

using uint = std::uint32_t;

#include "backends/gl/shaders/shared.glsl"
// (clang-format must not sort them)
#include "backends/gl/shaders/descent_data.glsl"

static_assert(sizeof(FrameData) == 80 && sizeof(DerivativeData) == 384);
static_assert(sizeof(DescentData) == 328 && sizeof(CameraData) == 168);
static_assert(sizeof(ViewModel) == 224 && sizeof(SearchData) == 1368);
static_assert(sizeof(ViewData) == 32 && sizeof(SceneData) == 64);

}  // namespace raylign::detail::gl::shared
