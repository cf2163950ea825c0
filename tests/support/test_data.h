#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace raylign::detail::test {

/// Folder with the real CTs and X-rays: $RAYLIGN_TEST_DATA, else shared/data beside the checkout.
inline std::filesystem::path test_data() {
    if (const char* path = std::getenv("RAYLIGN_TEST_DATA")) return path;
    return std::filesystem::path(RAYLIGN_SOURCE_DIR).parent_path() / "shared" / "data";
}

/// True where a missing thing must fail the test instead of skipping it (test.sh sets it where CI runs).
inline bool skips_are_failures() { return std::getenv("RAYLIGN_REQUIRE_DATA") != nullptr; }

}  // namespace raylign::detail::test

/// Skips (or fails, see above) a test whose real data is not there, with the reason.
#define RAYLIGN_NEED_DATA(path)                                                                     \
    if (!std::filesystem::exists(path)) {                                                           \
        if (raylign::detail::test::skips_are_failures()) FAIL() << "missing test data: " << (path); \
        GTEST_SKIP() << "missing test data: " << (path);                                            \
    }
