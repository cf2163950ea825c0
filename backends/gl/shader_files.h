#pragma once

#include <span>
#include <string_view>

namespace raylign::detail::gl {

/// A file of shaders/, put into the program by CMake (embed_shaders.cmake).
struct ShaderFile {
    std::string_view name, text;
};
[[nodiscard]] std::span<const ShaderFile> shader_files();

}  // namespace raylign::detail::gl
