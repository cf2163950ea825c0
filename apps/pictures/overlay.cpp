#include "apps/pictures/overlay.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/pictures/bitmap_font.h"
#include "apps/pictures/edges.h"
#include "apps/pictures/picture.h"

namespace raylign::detail::apps {
namespace {

constexpr int kPanelPx = 512;  // smaller pictures do not read well on today's screens
// Larger panels are scaled down: the overlay is to be looked at, drr_*.tif keeps the pixels.
constexpr int kLongestPx = 1024;
constexpr int kGapPx = 8, kTextScale = 3, kCaptionPx = kGlyphHeight * kTextScale + 2 * kGapPx;

// Brightness of the X-ray under the contours: thin coloured lines must stand out from bone.
constexpr double kUnderContours = 0.6;

// Orange and blue are told apart by colour-blind readers too [Okabe and Ito 2008].
constexpr Colour kOrange{255, 150, 0}, kBlue{60, 170, 255}, kWhite{255, 255, 255}, kPaper{16, 18, 22};

// Of several objects [Okabe and Ito 2008], brightened for a dark ground.
constexpr std::array<Colour, 8> kOfObjects{Colour{255, 150, 0},  Colour{60, 170, 255},  Colour{0, 200, 140},
                                           Colour{240, 228, 66}, Colour{230, 130, 190}, Colour{120, 140, 255},
                                           Colour{255, 90, 60},  Colour{200, 200, 200}};

/// All images, shrunk where they are too large, and how they are shown.
struct Shown {
    Image xray, weights, drr_start, drr_result;
    int factor = 1;    ///< shown pixels per (shrunk) image pixel
    double scale = 1;  ///< shown pixels per original pixel
};

Shown shown_images(const OverlayInput& input) {
    const auto shrink = [](const Image& image) { return image.empty() ? Image() : shrunk_to(image, kLongestPx); };
    Shown shown{shrink(input.xray), shrink(input.weights), shrink(input.drr_start), shrink(input.drr_result)};
    const int longer = std::max(shown.xray.width, shown.xray.height);
    shown.factor = (kPanelPx + longer - 1) / longer;
    shown.scale = shown.factor * static_cast<double>(shown.xray.width) / input.xray.width;
    return shown;
}

RgbImage grey_panel(const Shown& shown, const Image& image) {
    return grey_picture(enlarged(image, shown.factor), robust_window(image, shown.weights));
}

/// Grey X-ray with ignored pixels dimmed.
RgbImage xray_panel(const Shown& shown, const Image& image, double brightness) {
    RgbImage picture = grey_panel(shown, image);
    const Image weights = shown.weights.empty() ? Image() : enlarged(shown.weights, shown.factor);
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
        const bool ignored = !weights.empty() && !(weights.pixels[i] > 0.5F);
        for (std::uint8_t& channel : picture.pixels[i]) {
            channel = static_cast<std::uint8_t>(channel * brightness * (ignored ? 0.35 : 1.0));
        }
    }
    return picture;
}

/// Contours worth drawing, and weaker ones that suffice to say that the other image's contour is here too: noise breaks
/// contours in one image that hold together in the other, which must not look like a disagreement.
struct Contours {
    EdgeMap strong, weak;
};

Contours contours(const Image& image, const Shown& shown) {
    // Smoothed over 1/150 of the picture: finer detail is noise in an X-ray. Contours shorter than a seventh of a panel
    // (about one side of a vertebra) say little about the pose and are mostly noise too.
    const double sigma_px = std::clamp(std::max(image.width, image.height) / 150.0, 1.0, 8.0);
    const RidgeMap ridges = find_ridges(image, shown.weights, sigma_px, shown.factor);
    const auto find = [&](double kept_share, int shortest_px) {
        return thickened(find_edges(ridges, kept_share, shortest_px), 1);
    };
    return {find(0.3, kPanelPx / 7), find(0.6, kPanelPx / 20)};
}

/// Soft tissue varies slowly and hides bone: most of it is taken off, bone and its borders stay.
Image without_slow_parts(const Image& image) {
    const Image slow = smoothed(image, std::min(0.05 * image.width, 32.0));
    Image detail = image;
    for (std::size_t i = 0; i < detail.pixels.size(); ++i) detail.pixels[i] -= 0.75F * slow.pixels[i];
    return detail;
}

RgbImage contour_panel(const RgbImage& background, const Contours& xray, const Contours& drr) {
    RgbImage panel = background;
    for (std::size_t i = 0; i < panel.pixels.size(); ++i) {
        const std::uint8_t in_xray = xray.strong.sectors[i], in_drr = drr.strong.sectors[i];
        if (same_contour(in_xray, drr.weak.sectors[i]) || same_contour(in_drr, xray.weak.sectors[i])) {
            panel.pixels[i] = kWhite;
        } else if (in_drr != 0) {
            panel.pixels[i] = kOrange;
        } else if (in_xray != 0) {
            panel.pixels[i] = kBlue;
        }
    }
    return panel;
}

void draw_scale_bar(RgbImage& panel, double px_per_mm) {
    double length_mm = 10;
    while (length_mm * px_per_mm > 0.4 * panel.width && length_mm > 1) length_mm /= 10;
    while (length_mm * px_per_mm < 0.08 * panel.width) length_mm *= 2;
    const int length_px = static_cast<int>(std::lround(length_mm * px_per_mm));
    const int x = 12, y = panel.height - 18;
    fill(panel, x - 2, y - 2, length_px + 4, 8, kPaper);
    fill(panel, x, y, length_px, 4, kWhite);
    draw_text(panel, std::to_string(static_cast<int>(length_mm)) + " mm at the object", x + length_px + 10, y - 6, 2,
              kWhite);
}

struct Word {
    std::string text;
    Colour colour;
};

void draw_words(RgbImage& picture, const std::vector<Word>& words, int x, int y) {
    for (const Word& word : words) {
        draw_text(picture, word.text, x, y, kTextScale, word.colour);
        x += static_cast<int>(word.text.size() + 1) * kGlyphAdvance * kTextScale;
    }
}

}  // namespace

RgbImage overlay_picture(const OverlayInput& input) {
    const Shown shown = shown_images(input);
    const RgbImage dark_xray = xray_panel(shown, without_slow_parts(shown.xray), kUnderContours);
    const Contours xray_edges = contours(shown.xray, shown);
    RgbImage before = contour_panel(dark_xray, xray_edges, contours(shown.drr_start, shown));
    RgbImage after = contour_panel(dark_xray, xray_edges, contours(shown.drr_result, shown));
    if (input.px_per_mm) {
        draw_scale_bar(before, *input.px_per_mm * shown.scale);
        draw_scale_bar(after, *input.px_per_mm * shown.scale);
    }
    const int column = before.width + kGapPx, row = before.height + kCaptionPx;
    RgbImage picture = blank(2 * column + kGapPx, 2 * row + kGapPx, kPaper);
    const auto place = [&](const RgbImage& panel, int right, int down, const std::vector<Word>& caption) {
        draw_words(picture, caption, kGapPx + right * column, down * row + kGapPx);
        paste(picture, panel, kGapPx + right * column, down * row + kCaptionPx);
    };
    place(xray_panel(shown, shown.xray, 1), 0, 0, {{"X-ray " + input.view, kWhite}});
    place(grey_panel(shown, shown.drr_result), 1, 0, {{"CT, registered", kWhite}});
    place(before, 0, 1, {{"Before:", kWhite}, {"X-ray", kBlue}, {"CT", kOrange}, {"both", kWhite}});
    place(after, 1, 1, {{"After:", kWhite}, {"X-ray", kBlue}, {"CT", kOrange}, {"both", kWhite}});
    return picture;
}

RgbImage objects_picture(const ObjectsInput& input) {
    const Shown shown = shown_images({input.view, input.xray, input.weights, input.drr_sum, input.drr_sum, {}});
    const RgbImage dark_xray = xray_panel(shown, without_slow_parts(shown.xray), kUnderContours);
    const auto outlined = [&](const std::vector<Image>& drrs) {
        RgbImage panel = dark_xray;
        for (std::size_t k = 0; k < drrs.size(); ++k) {
            const EdgeMap edges = contours(shrunk_to(drrs[k], kLongestPx), shown).strong;
            for (std::size_t i = 0; i < panel.pixels.size(); ++i) {
                if (edges.sectors[i] != 0) panel.pixels[i] = kOfObjects[k % kOfObjects.size()];
            }
        }
        return panel;
    };
    const RgbImage before = outlined(input.drrs_start), after = outlined(input.drrs_result);
    const int column = before.width + kGapPx, row = before.height + kCaptionPx;
    const int legend = static_cast<int>(input.names.size());
    RgbImage picture = blank(2 * column + kGapPx, 2 * row + kGapPx + legend * kCaptionPx, kPaper);
    const auto place = [&](const RgbImage& panel, int right, int down, const std::string& caption) {
        draw_words(picture, {{caption, kWhite}}, kGapPx + right * column, down * row + kGapPx);
        paste(picture, panel, kGapPx + right * column, down * row + kCaptionPx);
    };
    place(xray_panel(shown, shown.xray, 1), 0, 0, "X-ray " + input.view);
    place(grey_panel(shown, shown.drr_result), 1, 0, "Objects, registered");
    place(before, 0, 1, "Before");
    place(after, 1, 1, "After");
    for (int k = 0; k < legend; ++k) {
        draw_words(picture, {{input.names[k], kOfObjects[k % kOfObjects.size()]}}, kGapPx,
                   2 * row + kGapPx + k * kCaptionPx);
    }
    return picture;
}

}  // namespace raylign::detail::apps
