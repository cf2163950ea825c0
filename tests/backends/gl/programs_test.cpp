#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "backends/gl/programs.h"
#include "core/base/error.h"
#include "gl_scenes.h"
#include "tests/support/test_folder.h"

namespace raylign::detail::gl {
namespace {

constexpr std::array<ShaderFile, 3> kFiles = {{
    {"main.comp", "#version 450\nlayout(local_size_x = 1) in;\n#include \"part.glsl\"\nvoid main() { part(); }\n"},
    {"part.glsl", "void part() {\n    nonsense;\n}\n"},
    {"lost.comp", "#version 450\n#include \"nowhere.glsl\"\n"},
}};

TEST(GlPrograms, IncludesKeepFilesAndLinesApart) {
    const std::array<Define, 1> defines = {{{"SIDE", 7}}};
    const ShaderText text = assemble("main.comp", defines, kFiles);
    EXPECT_EQ(text.text,
              "#version 450\n#define SIDE 7\n#line 2\nlayout(local_size_x = 1) in;\n"
              "#line 10001\nvoid part() {\n    nonsense;\n}\n#line 4\nvoid main() { part(); }\n");
    EXPECT_EQ(text.files, (std::vector<std::string>{"main.comp", "part.glsl"}));
}

TEST(GlPrograms, AMissingFileIsNamed) {
    try {
        (void)assemble("lost.comp", {}, kFiles);
        FAIL() << "must throw";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("nowhere.glsl"), std::string::npos);
    }
}

TEST(GlPrograms, LogsOfDriversNameFiles) {
    const std::vector<std::string> files = {"main.comp", "part.glsl"};
    EXPECT_EQ(named_log("0:10002(5): error: x\n0(12) : error C0000\n0:70001(2): y\nplain\n12 apples\n0:x", files),
              "part.glsl:2(5): error: x\nmain.comp(12) : error C0000\n0:70001(2): y\nplain\n12 apples\n0:x\n");
    EXPECT_EQ(named_log("", files), "");
}

TEST(GlPrograms, AnErrorIsShownWithFileAndLine) {
    RAYLIGN_NEED_GL(api);
    const auto context = open_device(api, {});
    const Current current(*context);
    try {
        (void)program(*context, {{"main.comp"}, {}}, kFiles);
        FAIL() << "must throw";
    } catch (const Error& error) {
        const std::string message = error.what();
        EXPECT_EQ(error.kind(), ErrorKind::unavailable);
        EXPECT_NE(message.find("shader main.comp"), std::string::npos) << message;
        const bool is_placed =
            message.find("part.glsl:2") != message.npos || message.find("part.glsl(2") != message.npos;
        EXPECT_TRUE(is_placed) << message;  // Mesa and Intel, NVIDIA
    }
}

TEST(GlPrograms, AreCompiledOnce) {
    RAYLIGN_NEED_GL(api);
    const auto context = open_device(api, {});
    const Current current(*context);
    const ProgramSource source{{"total.comp"}, {{"MAX_TAPS", 135}}};
    const GLuint first = program(*context, source);
    EXPECT_EQ(program(*context, source), first);
    EXPECT_NE(program(*context, {{"total.comp"}, {{"MAX_TAPS", 136}}}), first);
}

TEST(GlPrograms, SeveralAreMadeAtOnce) {
    RAYLIGN_NEED_GL(api);
    static int compiled_before_first_question = 0;
    static bool asked = false;
    static decltype(api.gl.LinkProgram) real_link = nullptr;
    static decltype(api.gl.GetProgramiv) real_get = nullptr;
    compiled_before_first_question = 0;
    asked = false;
    real_link = api.gl.LinkProgram;
    real_get = api.gl.GetProgramiv;
    api.gl.LinkProgram = [](GLuint id) {
        compiled_before_first_question += asked ? 0 : 1;
        real_link(id);
    };
    api.gl.GetProgramiv = [](GLuint id, GLenum name, GLint* value) {
        asked = true;
        real_get(id, name, value);
    };
    const auto context = open_device(api, {});
    const Current current(*context);
    const std::array<ProgramSource, 3> sources = {
        {{{"total.comp"}, {{"MAX_TAPS", 135}}},
         {{"total.comp"}, {{"MAX_TAPS", 136}}},
         {{"sums.comp"}, {{"GRADIENT", 1}, {"DERIVATIVES", 0}, {"MOST_RADIUS", 64}, {"MAX_TAPS", 136}}}}};
    make_programs(*context, sources);
    EXPECT_EQ(compiled_before_first_question, 3) << "a question waits for the compiler";
    EXPECT_EQ(context->programs().size(), 3u);
}

class KeptPrograms : public testing::Test {
protected:
    /// Compiles a program in a new context, as a new process would.
    void make() {
        const auto context = open_device(api, {});
        const Current current(*context);
        context->keep_programs_in(folder.path("programs"));
        (void)program(*context, {{"total.comp"}, {{"MAX_TAPS", 135}}});
    }
    /// Shaders compiled by make().
    int compiled_by_make() {
        static int count = 0;
        static decltype(api.gl.CompileShader) real = nullptr;
        count = 0;
        const auto compile = api.gl.CompileShader;
        real = compile;
        api.gl.CompileShader = [](GLuint id) {
            ++count;
            real(id);
        };
        make();
        api.gl.CompileShader = compile;
        return count;
    }

    Api api;
    test::TestFolder folder;
};

TEST_F(KeptPrograms, AreNotCompiledAgain) {
    RAYLIGN_NEED_GL(loaded);
    api = loaded;
    ASSERT_EQ(compiled_by_make(), 1);
    if (!std::filesystem::exists(folder.path("programs"))) GTEST_SKIP() << "this driver gives no binaries";
    EXPECT_EQ(compiled_by_make(), 0);
    for (const auto& file : std::filesystem::directory_iterator(folder.path("programs"))) {
        std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
    }
    EXPECT_EQ(compiled_by_make(), 1) << "a damaged file is made anew";
    EXPECT_EQ(compiled_by_make(), 0);
}

TEST_F(KeptPrograms, ADriverThatRefusesItsBinaryCompiles) {
    RAYLIGN_NEED_GL(loaded);
    api = loaded;
    ASSERT_EQ(compiled_by_make(), 1);
    api.gl.ProgramBinary = [](GLuint, GLenum, const void*, GLsizei) {};
    EXPECT_EQ(compiled_by_make(), 1);
}

TEST_F(KeptPrograms, AFolderThatCannotBeWrittenIsNoError) {
    RAYLIGN_NEED_GL(loaded);
    api = loaded;
    std::ofstream(folder.path("programs")) << "a file where the folder should be";
    EXPECT_EQ(compiled_by_make(), 1);
    EXPECT_EQ(compiled_by_make(), 1);
}

}  // namespace
}  // namespace raylign::detail::gl
