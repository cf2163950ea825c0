// Every shader text that a driver is given, read by another compiler: drivers differ in what they forgive.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "backends/gl/gl_session.h"
#include "core/descent.h"
#include "gl_scenes.h"
#include "tests/support/test_folder.h"

namespace raylign::detail::gl {
namespace {

std::map<GLuint, GLenum>& kinds() {
    static std::map<GLuint, GLenum> all;
    return all;
}
std::map<std::string, GLenum>& texts() {
    static std::map<std::string, GLenum> all;
    return all;
}

/// `api`, whose shaders' texts are kept.
Api listening(Api api) {
    static decltype(api.gl.CreateShader) create = nullptr;
    static decltype(api.gl.ShaderSource) source = nullptr;
    create = api.gl.CreateShader;
    source = api.gl.ShaderSource;
    api.gl.CreateShader = [](GLenum kind) {
        const GLuint id = create(kind);
        kinds()[id] = kind;
        return id;
    };
    api.gl.ShaderSource = [](GLuint id, GLsizei count, const GLchar* const* parts, const GLint* lengths) {
        texts()[std::string(parts[0], static_cast<std::size_t>(lengths[0]))] = kinds()[id];
        source(id, count, parts, lengths);
    };
    return api;
}

void work_with(const Api& api, Projector projector, bool exact) {
    const test::SpineScene spine(8, 16);
    const auto poses = spine.poses(1);
    const Interpolation interpolation = exact ? Interpolation::exact : Interpolation::hardware;
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const auto session = make_gl_backend(api, {.interpolation = interpolation, .solver = Solver::device})
                                 ->prepare(spine.scene(projector, metric));
        (void)test::costs(*session, poses);
        const DescentStart start{poses.front()};
        (void)session->descend({.centre_ct_mm = {0, 0, 0}, .radius_mm = 60, .before_batch = [] {}}, {&start, 1});
    }
    using Reduction = Gl2006Options::Reduction;
    for (const Reduction reduction : {Reduction::passes, Reduction::mipmap}) {
        Gl2006Options options;
        options.interpolation = interpolation;
        options.reduction = reduction;
        (void)test::costs(*make_gl_2006_backend(api, options)->prepare(spine.scene(projector)), poses);
    }
}

std::string ending_of(GLenum kind) {
    return kind == GL_COMPUTE_SHADER ? ".comp" : kind == GL_VERTEX_SHADER ? ".vert" : ".frag";
}

/// What glslangValidator says of a text; empty where it is content.
std::string said_of(const std::string& text, GLenum kind, const std::string& target, const test::TestFolder& folder) {
    const std::string file = folder.path("shader" + ending_of(kind)), log = folder.path("log");
    std::ofstream(file) << text;
    const std::string command = "glslangValidator " + target + " '" + file + "' > '" + log + "' 2>&1";
    if (std::system(command.c_str()) == 0) return {};
    std::stringstream said;
    said << std::ifstream(log).rdbuf();
    return said.str();
}

TEST(GlShaders, AreValidToAnotherCompiler) {
    RAYLIGN_NEED_GL(loaded);
    if (std::system("command -v glslangValidator > /dev/null") != 0) GTEST_SKIP() << "needs glslang-tools";
    texts().clear();
    const Api api = listening(loaded);
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        for (const bool exact : {false, true}) work_with(api, projector, exact);
    }
    EXPECT_GT(texts().size(), 20u);
    const test::TestFolder folder;
    for (const auto& [text, kind] : texts()) {
        for (const char* const target : {"", "--target-env opengl -o /dev/null"}) {
            EXPECT_EQ(said_of(text, kind, target, folder), "") << text.substr(0, 600);
        }
    }
    const std::string broken = "#version 450\nvoid main() { nonsense; }\n";
    EXPECT_NE(said_of(broken, GL_FRAGMENT_SHADER, "", folder), "") << "the other compiler finds faults";
}

}  // namespace
}  // namespace raylign::detail::gl
