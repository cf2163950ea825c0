#include <gtest/gtest.h>

#include <array>

#include "backends/gl/programs.h"
#include "core/base/error.h"
#include "gl_scenes.h"

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
        EXPECT_NE(message.find("part.glsl:2"), std::string::npos) << message;
    }
}

TEST(GlPrograms, AreCompiledOnce) {
    RAYLIGN_NEED_GL(api);
    const auto context = open_device(api, {});
    const Current current(*context);
    const ProgramSource source{{"rows.comp"}, {{"MAX_TAPS", 135}}};
    const GLuint first = program(*context, source);
    EXPECT_EQ(program(*context, source), first);
    EXPECT_NE(program(*context, {{"rows.comp"}, {{"MAX_TAPS", 136}}}), first);
}

}  // namespace
}  // namespace raylign::detail::gl
