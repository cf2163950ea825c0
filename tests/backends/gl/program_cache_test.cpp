#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "backends/gl/program_cache.h"
#include "tests/support/test_folder.h"

namespace raylign::detail::gl {
namespace {

const ProgramBinary kBinary{0x8E21, {'a', '\0', 'c'}};

class ProgramCache : public testing::Test {
protected:
    [[nodiscard]] std::filesystem::path only_file() const {
        const std::filesystem::directory_iterator files(programs);
        EXPECT_EQ(std::distance(begin(files), end(files)), 1) << "nothing unfinished beside it";
        return std::filesystem::directory_iterator(programs)->path();
    }

    test::TestFolder folder;
    std::filesystem::path programs = folder.path("a/b");
};

TEST_F(ProgramCache, GivesBackWhatItKept) {
    EXPECT_FALSE(read_program(programs, "driver 1"));
    keep_program(programs, "driver 1", kBinary);
    const auto found = read_program(programs, "driver 1");
    ASSERT_TRUE(found);
    EXPECT_EQ(found->format, kBinary.format);
    EXPECT_EQ(found->bytes, kBinary.bytes);
    EXPECT_FALSE(read_program(programs, "driver 2"));
    (void)only_file();
}

TEST_F(ProgramCache, TakesNoFileOfAnotherIdentity) {
    keep_program(programs, "driver 1", kBinary);
    const auto of_one = only_file();
    keep_program(programs, "driver 2", kBinary);
    for (const auto& file : std::filesystem::directory_iterator(programs)) {  // as if the names collided
        if (file.path() != of_one)
            std::filesystem::copy_file(of_one, file, std::filesystem::copy_options::overwrite_existing);
    }
    EXPECT_TRUE(read_program(programs, "driver 1"));
    EXPECT_FALSE(read_program(programs, "driver 2"));
}

TEST_F(ProgramCache, TakesNoDamagedFile) {
    keep_program(programs, "driver 1", kBinary);
    const auto file = only_file();
    const auto size = std::filesystem::file_size(file);
    for (std::uintmax_t at = 0; at < size; ++at) {
        std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
        bytes.seekg(static_cast<std::streamoff>(at));
        const auto byte = static_cast<char>(bytes.get());
        bytes.seekp(static_cast<std::streamoff>(at));
        bytes.put(static_cast<char>(byte ^ 1));
        bytes.close();
        EXPECT_FALSE(read_program(programs, "driver 1")) << at;
        keep_program(programs, "driver 1", kBinary);
    }
    for (std::uintmax_t length = 0; length < size; ++length) {
        std::filesystem::resize_file(file, length);
        EXPECT_FALSE(read_program(programs, "driver 1")) << length;
        keep_program(programs, "driver 1", kBinary);
    }
    EXPECT_TRUE(read_program(programs, "driver 1"));
}

TEST_F(ProgramCache, StandsWhereTheEnvironmentSays) {
    ASSERT_EQ(setenv("RAYLIGN_PROGRAM_FOLDER", "/tmp/x", 1), 0);
    EXPECT_EQ(default_program_folder(), "/tmp/x");
    ASSERT_EQ(setenv("RAYLIGN_PROGRAM_FOLDER", "", 1), 0);
    EXPECT_TRUE(default_program_folder().empty()) << "nothing is kept";
    ASSERT_EQ(unsetenv("RAYLIGN_PROGRAM_FOLDER"), 0);
    ASSERT_EQ(setenv("XDG_CACHE_HOME", "/tmp/cache", 1), 0);
    EXPECT_EQ(default_program_folder(), "/tmp/cache/raylign/programs");
    ASSERT_EQ(unsetenv("XDG_CACHE_HOME"), 0);
    const char* const home = std::getenv("HOME");
    EXPECT_EQ(default_program_folder().empty(), home == nullptr || *home != '/');
}

}  // namespace
}  // namespace raylign::detail::gl
