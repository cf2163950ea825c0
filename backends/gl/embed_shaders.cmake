# Writes OUTPUT, a C++ file with the texts of FILES (a list of paths separated by |), for shader_files.h.
string(REPLACE "|" ";" files "${FILES}")
set(entries "")
foreach(path IN LISTS files)
  file(READ ${path} text)
  cmake_path(GET path FILENAME name)
  string(APPEND entries "    {\"${name}\", R\"RAYLIGN(${text})RAYLIGN\"},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"backends/gl/shader_files.h\"

namespace raylign::detail::gl {
namespace {

constexpr ShaderFile kFiles[] = {
${entries}};

}  // namespace

std::span<const ShaderFile> shader_files() { return kFiles; }

}  // namespace raylign::detail::gl
")
