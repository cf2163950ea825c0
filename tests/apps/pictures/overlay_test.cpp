#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "apps/pictures/bitmap_font.h"
#include "apps/pictures/edges.h"
#include "apps/pictures/overlay.h"
#include "apps/pictures/picture.h"

namespace raylign::detail::apps {
namespace {

/// A soft-edged disc, denser inside.
Image disc(int size, double centre_x, double centre_y, double radius) {
    Image image(size, size);
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const double distance = std::hypot(x - centre_x, y - centre_y);
            image(x, y) = static_cast<float>(1 / (1 + std::exp(2 * (distance - radius))));
        }
    }
    return image;
}

/// Coloured pixels (not grey) in a part of the picture.
std::size_t coloured_pixels(const RgbImage& picture, int x0, int x1, int y0, int y1) {
    std::size_t count = 0;
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            const auto& [red, green, blue] = picture.pixels[static_cast<std::size_t>(y) * picture.width + x];
            if (std::abs(red - blue) > 60) ++count;
        }
    }
    return count;
}

TEST(RobustWindow, IgnoresHotPixelsAndMaskedOnes) {
    Image image(100, 100);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i % 100);
    Image weights(100, 100, 1);
    image(3, 3) = 1e6F;
    for (int x = 0; x < 100; ++x) {
        image(x, 0) = -1e6F;
        weights(x, 0) = 0;
    }
    const Window window = robust_window(image, weights);
    EXPECT_NEAR(window.low, 1, 1);
    EXPECT_NEAR(window.high, 98, 1);
}

TEST(RobustWindow, OfAConstantImageIsNotEmpty) {
    const Window window = robust_window(Image(4, 4, 7), {});
    EXPECT_LT(window.low, window.high);
}

TEST(GreyPicture, ShowsDenserBrighter) {
    Image image(2, 1);
    image(1, 0) = 1;
    const RgbImage picture = grey_picture(image, {0, 1});
    EXPECT_EQ(picture.pixels[0], (Colour{0, 0, 0}));
    EXPECT_EQ(picture.pixels[1], (Colour{255, 255, 255}));
}

TEST(Enlarged, KeepsARampInPlace) {
    Image ramp(8, 1);
    for (int x = 0; x < 8; ++x) ramp(x, 0) = static_cast<float>(x);
    const Image large = enlarged(ramp, 4);
    for (int x = 6; x < 26; ++x) EXPECT_NEAR(large(x, 0), (x + 0.5) / 4 - 0.5, 1e-6);
}

TEST(ShrunkTo, AveragesAndStopsAtTheLimit) {
    const Image small = shrunk_to(disc(64, 31.5, 31.5, 20), 20);
    EXPECT_EQ(small.width, 16);
    EXPECT_NEAR(small(8, 8), 1, 1e-3);
}

EdgeMap edges_of(const Image& image, const Image& weights = {}) {
    return find_edges(find_ridges(image, weights, 1.5, 1), 0.5, 20);
}

TEST(FindEdges, FollowsACircle) {
    const EdgeMap edges = edges_of(disc(128, 60, 64, 30));
    std::size_t count = 0;
    for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 128; ++x) {
            if (edges(x, y) == 0) continue;
            ++count;
            EXPECT_NEAR(std::hypot(x - 60, y - 64), 30, 1.5);
        }
    }
    EXPECT_GT(count, 150U);  // the circle is 188 px long
}

TEST(FindEdges, KeepsTheirPlaceWhenEnlarged) {
    const EdgeMap edges = find_edges(find_ridges(disc(64, 30, 32, 15), {}, 1.5, 4), 0.5, 20);
    ASSERT_EQ(edges.width, 256);
    for (int y = 0; y < 256; ++y) {
        for (int x = 0; x < 256; ++x) {
            if (edges(x, y) == 0) continue;
            EXPECT_NEAR(std::hypot((x + 0.5) / 4 - 0.5 - 30, (y + 0.5) / 4 - 0.5 - 32), 15, 0.5);
        }
    }
}

TEST(FindEdges, FindsNothingInAConstantImageNorInItsMask) {
    const std::vector<std::uint8_t> nothing(64 * 64, 0);
    EXPECT_EQ(edges_of(Image(64, 64, 3)).sectors, nothing);
    EXPECT_EQ(edges_of(disc(64, 32, 32, 15), Image(64, 64, 0)).sectors, nothing);
}

TEST(FindEdges, TellsTheTwoSidesOfADiscApart) {
    const EdgeMap edges = edges_of(disc(128, 64, 64, 30));
    const std::uint8_t left = edges(34, 64), right = edges(94, 64);
    EXPECT_TRUE(same_contour(left, left));
    EXPECT_FALSE(same_contour(left, right));
    EXPECT_FALSE(same_contour(left, 0));
}

TEST(SameContour, WrapsAroundTheCircle) {
    EXPECT_TRUE(same_contour(1, 8));
    EXPECT_TRUE(same_contour(4, 5));
    EXPECT_FALSE(same_contour(1, 3));
}

TEST(OverlayPicture, HasFourPanelsOfAtLeast512Px) {
    const Image image = disc(100, 50, 50, 25);
    const RgbImage picture = overlay_picture({"AP", image, {}, image, image, 1.0});
    EXPECT_GE(picture.width, 2 * 512);
    EXPECT_GE(picture.height, 2 * 512);
    EXPECT_EQ(picture.pixels.size(), static_cast<std::size_t>(picture.width) * picture.height);
}

TEST(OverlayPicture, ShowsAMisalignmentInColourAndAgreementWithout) {
    const Image xray = disc(128, 64, 64, 30), off = disc(128, 69, 64, 30);
    const RgbImage picture = overlay_picture({"AP", xray, {}, off, xray, {}});
    const int middle_x = picture.width / 2, middle_y = picture.height / 2;
    const std::size_t before = coloured_pixels(picture, 0, middle_x, middle_y + 60, picture.height);
    const std::size_t after = coloured_pixels(picture, middle_x, picture.width, middle_y + 60, picture.height);
    EXPECT_GT(before, 1000U);
    EXPECT_EQ(after, 0U);
}

TEST(OverlayPicture, ShrinksVeryLargeImages) {
    const Image image(3000, 2000, 1);
    const RgbImage picture = overlay_picture({"AP", image, {}, image, image, {}});
    EXPECT_LE(picture.width, 2 * 1024 + 3 * 8);  // two panels and three gaps
}

TEST(BitmapFont, LettersDiffer) {
    const auto shape = [](char letter) {
        std::string bits;
        for (int row = 0; row < kGlyphHeight; ++row) {
            for (int column = 0; column < kGlyphWidth; ++column) bits += glyph_bit(letter, column, row) ? '#' : '.';
        }
        return bits;
    };
    std::vector<std::string> shapes;
    for (const char letter : std::string(" %()+,-./0123456789:=>ABCDEFGHIJKLMNOPQRSTUVWXYZ_"))
        shapes.push_back(shape(letter));
    std::ranges::sort(shapes);
    EXPECT_EQ(std::ranges::adjacent_find(shapes), shapes.end());
    EXPECT_EQ(shape('a'), shape('A'));
}

}  // namespace
}  // namespace raylign::detail::apps
