#include "backends/gl/programs.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <utility>

#include "backends/gl/program_cache.h"
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

std::string name_of(const ProgramSource& source) {
    std::string name;
    for (const std::string& file : source.files) name += (name.empty() ? "" : "+") + file;
    for (const Define& define : source.defines) name += " " + define.name + "=" + std::to_string(define.value);
    return name;
}

/// A program whose shaders the driver may still be compiling.
struct Begun {
    std::string name;
    std::vector<ShaderText> texts;
    std::vector<Shader> shaders;  ///< none where the program was kept
    Program program;
};

/// What a kept program must be of: another driver's binary, or another text's, is not taken.
ProgramIdentity identity_of(const Context& context, const Begun& begun) {
    ProgramIdentity identity = context.device().vendor + "\n" + context.device().renderer + "\n" +
                               context.device().version + "\n" + begun.name + "\n";
    for (const ShaderText& text : begun.texts) identity += text.text;
    return identity;
}

bool is_linked(Context& context, const Program& program) {
    GLint linked = GL_FALSE;
    context.gl().GetProgramiv(program.id(), GL_LINK_STATUS, &linked);
    return linked == GL_TRUE;
}

/// True if the program was kept and the driver takes it.
bool take_kept(Context& context, Begun& begun) {
    if (context.program_folder().empty()) return false;
    const std::optional<ProgramBinary> kept = read_program(context.program_folder(), identity_of(context, begun));
    if (!kept) return false;
    context.gl().ProgramBinary(begun.program.id(), kept->format, kept->bytes.data(),
                               static_cast<GLsizei>(kept->bytes.size()));
    (void)context.gl().GetError();  // an unknown format is one, and no reason to stop
    return is_linked(context, begun.program);
}

void keep(Context& context, const Begun& begun) {
    if (context.program_folder().empty()) return;
    const Gl& gl = context.gl();
    GLint length = 0;
    gl.GetProgramiv(begun.program.id(), GL_PROGRAM_BINARY_LENGTH, &length);
    if (length <= 0) return;
    ProgramBinary binary{0, std::vector<char>(static_cast<std::size_t>(length))};
    gl.GetProgramBinary(begun.program.id(), length, &length, &binary.format, binary.bytes.data());
    if (gl.GetError() != GL_NO_ERROR) return;
    binary.bytes.resize(static_cast<std::size_t>(length));
    keep_program(context.program_folder(), identity_of(context, begun), binary);
}

/// Asks for nothing that would wait for the compiler.
Begun begin(Context& context, const ProgramSource& source, std::span<const ShaderFile> files) {
    const Gl& gl = context.gl();
    Begun begun{.name = name_of(source), .texts = {}, .shaders = {}, .program = {}};
    begun.program = Program(gl, gl.CreateProgram(), begun.name);
    for (const std::string& file : source.files) begun.texts.push_back(assemble(file, source.defines, files));
    if (take_kept(context, begun)) return begun;
    begun.program = Program(gl, gl.CreateProgram(), begun.name);  // what failed to load is used up
    gl.ProgramParameteri(begun.program.id(), GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
    for (std::size_t i = 0; i < source.files.size(); ++i) {
        Shader& shader = begun.shaders.emplace_back(gl, gl.CreateShader(stage_of(source.files[i])), source.files[i]);
        const GLchar* text = begun.texts[i].text.data();
        const auto length = static_cast<GLint>(begun.texts[i].text.size());
        gl.ShaderSource(shader.id(), 1, &text, &length);
        gl.CompileShader(shader.id());
        gl.AttachShader(begun.program.id(), shader.id());
    }
    gl.LinkProgram(begun.program.id());
    return begun;
}

void check_compiled(Context& context, const Shader& shader, const ShaderText& text) {
    const Gl& gl = context.gl();
    GLint compiled = GL_FALSE;
    gl.GetShaderiv(shader.id(), GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_TRUE) return;
    throw Error("shader " + text.files.front() + " does not compile on " + context.device().renderer + ":\n" +
                    named_log(log_of(shader.id(), gl.GetShaderiv, gl.GetShaderInfoLog), text.files),
                ErrorKind::unavailable);
}

void finish(Context& context, Begun begun) {
    for (std::size_t i = 0; i < begun.shaders.size(); ++i) {
        check_compiled(context, begun.shaders[i], begun.texts[i]);
    }
    const Gl& gl = context.gl();
    if (!is_linked(context, begun.program)) {
        throw Error("shaders " + begun.name + " do not link on " + context.device().renderer + ":\n" +
                        log_of(begun.program.id(), gl.GetProgramiv, gl.GetProgramInfoLog),
                    ErrorKind::unavailable);
    }
    context.check("compiling " + begun.name);
    if (!begun.shaders.empty()) keep(context, begun);
    context.programs().emplace(std::move(begun.name), std::move(begun.program));
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

void make_programs(Context& context, std::span<const ProgramSource> sources, std::span<const ShaderFile> files) {
    std::vector<Begun> all;
    for (const ProgramSource& source : sources) {
        if (!context.programs().contains(name_of(source))) all.push_back(begin(context, source, files));
    }
    for (Begun& begun : all) finish(context, std::move(begun));
}

GLuint program(Context& context, const ProgramSource& source, std::span<const ShaderFile> files) {
    const std::string name = name_of(source);
    if (const auto made = context.programs().find(name); made != context.programs().end()) return made->second.id();
    make_programs(context, {&source, 1}, files);
    return context.programs().at(name).id();
}

}  // namespace raylign::detail::gl
