// What README.md shows must be what the program reads.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "core/io/files/output.h"
#include "raylign/io/views.h"

namespace raylign::detail {
namespace {

/// The first fenced block of README.md in `language`.
std::string readme_block(const std::string& language) {
    std::ifstream file(std::string(RAYLIGN_SOURCE_DIR) + "/README.md");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::size_t fence = text.find("```" + language + "\n");
    if (fence == std::string::npos) return "";
    const std::size_t begin = text.find('\n', fence) + 1;
    return text.substr(begin, text.find("```", begin) - begin);
}

TEST(Readme, ItsViewsAreReadAndStandAtRightAngles) {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "readme_views.json";
    write_text(path, readme_block("json"));
    const ViewsFile file = read_views(path, ReadImages::never);
    ASSERT_EQ(file.views.size(), 2u);
    const ViewGeometry &frontal = file.views[0].geometry, &lateral = file.views[1].geometry;
    const double cosine =
        frontal.camera_from_world.rotation.row(2).dot(lateral.camera_from_world.rotation.row(2).transpose());
    EXPECT_NEAR(cosine, 0, 1e-9);
    EXPECT_NEAR(source_world_mm(frontal).norm(), 1000, 1e-6);
    EXPECT_NEAR(source_world_mm(lateral).norm(), 1000, 1e-6);
    // Both show the head at the top: a point towards the head lies higher in the image (smaller row).
    for (const View& view : file.views) {
        EXPECT_LT(project(view.geometry, {0, 0, 50}).y(), project(view.geometry, {0, 0, 0}).y()) << view.name;
    }
    std::filesystem::remove(path);
}

}  // namespace
}  // namespace raylign::detail
