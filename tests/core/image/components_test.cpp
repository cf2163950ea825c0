#include <gtest/gtest.h>

#include <string_view>

#include "core/image/components.h"

namespace raylign::detail {
namespace {

/// '#' are true; a row a line.
std::vector<Component> pieces_of(std::string_view picture, int width) {
    std::vector<bool> pixels;
    for (const char c : picture) pixels.push_back(c == '#');
    return components_of(pixels, width, static_cast<int>(pixels.size()) / width);
}

TEST(Components, OfAnEmptyPictureAreNone) {
    EXPECT_TRUE(pieces_of("......", 3).empty());
    EXPECT_TRUE(components_of({}, 0, 0).empty());
}

TEST(Components, AFullPictureIsOne) {
    const auto pieces = pieces_of("######", 3);
    ASSERT_EQ(pieces.size(), 1u);
    EXPECT_EQ(pieces[0].pixels.size(), 6u);
}

TEST(Components, CornersTouch) {
    EXPECT_EQ(pieces_of("#.."
                        ".#."
                        "..#",
                        3)
                  .size(),
              1u);
    EXPECT_EQ(pieces_of("..#"
                        ".#."
                        "#..",
                        3)
                  .size(),
              1u);
}

TEST(Components, EndsOfNeighbouringRowsDoNotTouch) {
    EXPECT_EQ(pieces_of("...#"
                        "#...",
                        4)
                  .size(),
              2u);
}

TEST(Components, ComeInTheOrderOfTheirFirstPixel) {
    const auto pieces = pieces_of(
        "..#.#"
        "#.#.."
        "#...#",
        5);
    ASSERT_EQ(pieces.size(), 4u);
    EXPECT_EQ(pieces[0].pixels.front(), 2u);
    EXPECT_EQ(pieces[1].pixels.front(), 4u);
    EXPECT_EQ(pieces[2].pixels.front(), 5u);
    EXPECT_EQ(pieces[3].pixels.front(), 14u);
}

TEST(Components, HaveTheirBoundingBox) {
    const auto pieces = pieces_of(
        "......"
        "..##.."
        ".#...."
        "......",
        6);
    ASSERT_EQ(pieces.size(), 1u);
    EXPECT_EQ(pieces[0].low_x, 1);
    EXPECT_EQ(pieces[0].high_x, 3);
    EXPECT_EQ(pieces[0].low_y, 1);
    EXPECT_EQ(pieces[0].high_y, 2);
}

TEST(Components, HoldEachTruePixelOnce) {
    constexpr std::string_view kPicture =
        "##.#.#"
        "#..###"
        "..#..."
        "#...##";
    std::vector<int> seen(kPicture.size(), 0);
    for (const Component& piece : pieces_of(kPicture, 6)) {
        for (const std::size_t i : piece.pixels) ++seen[i];
    }
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], kPicture[i] == '#' ? 1 : 0) << i;
}

TEST(Components, ARingIsOneAndItsHoleNone) {
    const auto pieces = pieces_of(
        "#####"
        "#...#"
        "#.#.#"
        "#...#"
        "#####",
        5);
    ASSERT_EQ(pieces.size(), 2u);
    EXPECT_EQ(pieces[0].pixels.size(), 16u);
    EXPECT_EQ(pieces[1].pixels, std::vector<std::size_t>{12});
}

}  // namespace
}  // namespace raylign::detail
