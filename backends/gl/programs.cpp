#include "backends/gl/programs.h"

#include <algorithm>
#include <cctype>
#include <charconv>

#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

std::string_view find_file(std::string_view name, std::span<const ShaderFile> files) {
    const auto found = std::ranges::find(files, name, &ShaderFile::name);
    if (found == files.end()) throw Error("shader file " + std::string(name) + " is not part of this build");
    return found->text;
}

/// Lines of file number n are counted from n times this. GLSL has numbers for files, too, but Mesa forgets them.
constexpr std::size_t kLinesPerFile = 10000;

std::string line_directive(std::size_t number, int line) {
    return "#line " + std::to_string(number * kLinesPerFile + line) + "\n";
}

/// Appends a file line by line; `#include "name"` lines are replaced by that file, once each.
void append(ShaderText& out, std::string_view name, std::span<const Define> defines,
            std::span<const ShaderFile> files) {
    const std::size_t number = out.files.size();
    out.files.emplace_back(name);
    std::string_view rest = find_file(name, files);
    if (number > 0) out.text += line_directive(number, 1);
    for (int line = 1; !rest.empty(); ++line) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        const std::string_view text = rest.substr(0, end);
        rest.remove_prefix(std::min(end + 1, rest.size()));
        const std::string back = line_directive(number, line + 1);
        if (text.starts_with("#include \"")) {
            const std::string included(text.substr(10, text.rfind('"') - 10));
            if (std::ranges::find(out.files, included) == out.files.end()) append(out, included, {}, files);
            out.text += back;
            continue;
        }
        out.text += std::string(text) + "\n";
        if (!text.starts_with("#version")) continue;
        for (const Define& define : defines) {
            out.text += "#define " + define.name + " " + std::to_string(define.value) + "\n";
        }
        out.text += back;
    }
}

GLenum stage_of(const std::string& file) {
    if (file.ends_with(".comp")) return GL_COMPUTE_SHADER;
    return file.ends_with(".vert") ? GL_VERTEX_SHADER : GL_FRAGMENT_SHADER;
}

/// The log of a shader or program, through the functions for its kind.
template <class GetParameter, class GetLog>
std::string log_of(GLuint id, GetParameter get_parameter, GetLog get_log) {
    GLint length = 0;
    get_parameter(id, GL_INFO_LOG_LENGTH, &length);
    std::string log(static_cast<std::size_t>(std::max(length, 1)), '\0');
    get_log(id, length, &length, log.data());
    log.resize(static_cast<std::size_t>(std::max(length, 0)));
    return log;
}

Shader compile(Context& context, const std::string& file, const ShaderText& source) {
    const Gl& gl = context.gl();
    Shader shader(gl, gl.CreateShader(stage_of(file)), file);
    const GLchar* text = source.text.data();
    const auto length = static_cast<GLint>(source.text.size());
    gl.ShaderSource(shader.id(), 1, &text, &length);
    gl.CompileShader(shader.id());
    GLint compiled = GL_FALSE;
    gl.GetShaderiv(shader.id(), GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_TRUE) return shader;
    const std::string log = log_of(shader.id(), gl.GetShaderiv, gl.GetShaderInfoLog);
    throw Error(
        "shader " + file + " does not compile on " + context.device().renderer + ":\n" + named_log(log, source.files),
        ErrorKind::unavailable);
}

}  // namespace

ShaderText assemble(std::string_view file, std::span<const Define> defines, std::span<const ShaderFile> files) {
    ShaderText text;
    append(text, file, defines, files);
    return text;
}

std::string named_log(std::string_view log, const std::vector<std::string>& files) {
    std::string out;
    while (!log.empty()) {
        const std::string_view line = log.substr(0, std::min(log.find('\n'), log.size()));
        log.remove_prefix(std::min(line.size() + 1, log.size()));
        // A number for the source, ':' or '(', and the line as counted above.
        const char* const end = line.data() + line.size();
        std::size_t source = 0, place = 0;
        const auto [after, status] = std::from_chars(line.data(), end, source);
        const bool marked = status == std::errc{} && after != end && (*after == ':' || *after == '(');
        const auto [rest, found] = std::from_chars(marked ? after + 1 : end, end, place);
        if (marked && found == std::errc{} && place / kLinesPerFile < files.size()) {
            out += files[place / kLinesPerFile] + *after + std::to_string(place % kLinesPerFile);
            out.append(rest, end);
        } else {
            out += line;
        }
        out += '\n';
    }
    return out;
}

GLuint program(Context& context, const ProgramSource& source, std::span<const ShaderFile> files) {
    std::string key;
    for (const std::string& file : source.files) key += (key.empty() ? "" : "+") + file;
    for (const Define& define : source.defines) key += " " + define.name + "=" + std::to_string(define.value);
    if (const auto made = context.programs().find(key); made != context.programs().end()) return made->second.id();

    const Gl& gl = context.gl();
    Program made(gl, gl.CreateProgram(), key);
    for (const std::string& file : source.files) {
        const Shader shader = compile(context, file, assemble(file, source.defines, files));
        gl.AttachShader(made.id(), shader.id());
    }
    gl.LinkProgram(made.id());
    GLint linked = GL_FALSE;
    gl.GetProgramiv(made.id(), GL_LINK_STATUS, &linked);
    if (linked != GL_TRUE) {
        throw Error("shaders " + key + " do not link on " + context.device().renderer + ":\n" +
                        log_of(made.id(), gl.GetProgramiv, gl.GetProgramInfoLog),
                    ErrorKind::unavailable);
    }
    context.check("compiling " + key);
    return context.programs().emplace(key, std::move(made)).first->second.id();
}

}  // namespace raylign::detail::gl
