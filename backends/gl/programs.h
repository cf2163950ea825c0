#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/gl/context.h"
#include "backends/gl/shader_files.h"

namespace raylign::detail::gl {

/// "#define NAME VALUE" at the top of a shader.
struct Define {
    std::string name;
    int value = 1;
};

/// What a program is made from: files of shaders/, whose #include "..." lines are resolved here.
struct ProgramSource {
    std::vector<std::string> files;  ///< one .comp, or .vert and .frag
    std::vector<Define> defines;
};

/// One shader's text with its includes, and the names of the files that its #line directives stand for.
struct ShaderText {
    std::string text;
    std::vector<std::string> files;
};
/// Throws Error for a file that is not among `files`.
[[nodiscard]] ShaderText assemble(std::string_view file, std::span<const Define> defines,
                                  std::span<const ShaderFile> files = shader_files());

/// A driver's log with the names and lines of files in the place of numbers: "0:10012(5): error" and "0(10012) : error"
/// become "ray.glsl:12(5): error" and "ray.glsl(12) : error" where that is file 1.
[[nodiscard]] std::string named_log(std::string_view log, const std::vector<std::string>& files);

/// The program, compiled when it is first asked for. Throws Error, kind unavailable, with the file, the line and the
/// driver's log where it does not compile. The context must be current.
[[nodiscard]] GLuint program(Context& context, const ProgramSource& source,
                             std::span<const ShaderFile> files = shader_files());
/// The same for several at once, which drivers compile side by side; from the context's program folder where they are
/// kept there (program_cache.h).
void make_programs(Context& context, std::span<const ProgramSource> sources,
                   std::span<const ShaderFile> files = shader_files());

}  // namespace raylign::detail::gl
