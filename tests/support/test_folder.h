#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace raylign::detail::test {

/// A fresh folder for the running test, removed when the object goes.
class TestFolder {
public:
    TestFolder() : folder_(fresh_folder()) {}
    ~TestFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(folder_, ignored);
    }
    TestFolder(const TestFolder&) = delete;
    TestFolder& operator=(const TestFolder&) = delete;

    [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

private:
    static std::filesystem::path fresh_folder() {
        const std::string pattern = (std::filesystem::temp_directory_path() / "raylign_test_XXXXXX").string();
        std::vector<char> name(pattern.begin(), pattern.end());
        name.push_back('\0');
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a temporary folder");
        return name.data();
    }

    std::filesystem::path folder_;
};

}  // namespace raylign::detail::test
