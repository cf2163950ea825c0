// Two processes on one device at once.

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "gl_scenes.h"

namespace raylign::detail::gl {
namespace {

constexpr const char* kChild = "RAYLIGN_TEST_GL_CHILD";

/// Costs as exact text.
std::string work(const Api& api) {
    const test::SpineScene spine;
    const auto session = make_gl_backend(api, {})->prepare(spine.scene());
    std::string text;
    for (int turn = 0; turn < 5; ++turn) {
        for (const double cost : test::costs(*session, spine.poses(4))) {
            std::array<char, 40> digits{};
            (void)std::snprintf(digits.data(), digits.size(), "%a ", cost);
            text += digits.data();
        }
    }
    return text;
}

TEST(GlProcesses, TwoShareADevice) {
    RAYLIGN_NEED_GL(api);
    if (std::getenv(kChild) != nullptr) {
        std::printf("COSTS %s\n", work(api).c_str());
        return;
    }
    const std::string self = std::filesystem::read_symlink("/proc/self/exe");
    const std::string command =
        std::string(kChild) + "=1 '" + self + "' --gtest_filter=GlProcesses.TwoShareADevice 2>&1";
    FILE* const child = popen(command.c_str(), "r");
    ASSERT_NE(child, nullptr);
    const std::string ours = work(api);
    std::string theirs;
    for (std::array<char, 4096> part{}; std::fgets(part.data(), part.size(), child) != nullptr;) theirs += part.data();
    EXPECT_EQ(pclose(child), 0) << theirs;
    EXPECT_NE(theirs.find("COSTS " + ours), std::string::npos) << theirs << "\nours: " << ours;
}

}  // namespace
}  // namespace raylign::detail::gl
