#include "core/image/auto_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/text.h"
#include "core/image/components.h"
#include "core/image/convex_hull.h"
#include "core/image/mark_contrast.h"
#include "core/image/round_field.h"

namespace raylign::detail {
namespace {

constexpr int kCoarseSide = 512;  // px: shapes are judged on an image of about this size

/// Block means of `factor`^2 pixels; unusable ones are left out, NaN where none is usable.
Image coarse_image(const Image& image, const Image& weights, int factor) {
    Image coarse(image.width / factor, image.height / factor);
    for (int y = 0; y < coarse.height; ++y) {
        for (int x = 0; x < coarse.width; ++x) {
            double sum = 0, count = 0;
            for (int k = 0; k < factor * factor; ++k) {
                const int u = x * factor + k % factor, v = y * factor + k / factor;
                if (!std::isfinite(image(u, v)) || (!weights.empty() && !(weights(u, v) > 0))) continue;
                sum += image(u, v);
                ++count;
            }
            coarse(x, y) = count > 0 ? static_cast<float>(sum / count) : std::numeric_limits<float>::quiet_NaN();
        }
    }
    return coarse;
}

int coarse_factor(const Image& image, int side = kCoarseSide) {
    return std::max(1, (std::max(image.width, image.height) + side - 1) / side);
}

struct Range {
    double low = 0, high = 0;
};

/// The range between the 0.1th and 99.9th percentile of the finite pixels.
Range range_of(const Image& image) {
    std::vector<float> values;
    std::ranges::copy_if(image.pixels, std::back_inserter(values), [](float v) { return std::isfinite(v); });
    if (values.empty()) return {};
    const auto at = [&](double share) {
        const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), place, values.end());
        return static_cast<double>(*place);
    };
    const double low = at(0.001);
    return {low, at(0.999)};
}

double share_of_zeros(const Image& weights) {
    return static_cast<double>(std::ranges::count(weights.pixels, 0.0F)) / static_cast<double>(weights.pixels.size());
}

/// Sets 0 the square of +-`radius` around each marked pixel of the coarse image, in the full one.
Image weights_without(const std::vector<bool>& marked, const Image& coarse, const Image& full, int factor,
                      int radius_px) {
    Image weights(full.width, full.height, 1);
    for (int y = 0; y < coarse.height; ++y) {
        for (int x = 0; x < coarse.width; ++x) {
            if (!marked[coarse.index(x, y)]) continue;
            for (int v = std::max(0, y * factor - radius_px); v < std::min(full.height, (y + 1) * factor + radius_px);
                 ++v) {
                for (int u = std::max(0, x * factor - radius_px);
                     u < std::min(full.width, (x + 1) * factor + radius_px); ++u) {
                    weights(u, v) = 0;
                }
            }
        }
    }
    return weights;
}

/// The convex piece of bright pixels that may be the field; empty where there is none.
struct BrightPiece {
    std::vector<bool> pixels;
    std::vector<HullPoint> hull;
};

/// The first and the last pixel of each row: no other can be a corner of their hull.
std::vector<HullPoint> ends_of_rows(const std::vector<bool>& pixels, const Image& image) {
    std::vector<HullPoint> ends;
    for (int y = 0; y < image.height; ++y) {
        int first = 0, last = image.width - 1;
        while (first <= last && !pixels[image.index(first, y)]) ++first;
        while (last > first && !pixels[image.index(last, y)]) --last;
        if (first > last) continue;
        ends.push_back({static_cast<double>(first), static_cast<double>(y)});
        if (last > first) ends.push_back({static_cast<double>(last), static_cast<double>(y)});
    }
    return ends;
}

BrightPiece bright_piece(const Image& coarse) {
    constexpr double kDarkShare = 0.1;        // of the range: blooming and scatter outside the field stay below
    constexpr double kSecondShare = 0.02;     // of the largest piece: more is air on the other side of a dark body
    constexpr double kLeastFieldShare = 0.1;  // of the image
    const Range range = range_of(coarse);
    const double threshold = range.low + kDarkShare * (range.high - range.low);
    std::vector<bool> bright(coarse.pixels.size());
    for (std::size_t i = 0; i < bright.size(); ++i) bright[i] = coarse.pixels[i] > threshold;  // NaN is dark
    std::vector<Component> pieces = components_of(bright, coarse.width, coarse.height);
    std::ranges::sort(pieces, std::greater<>(), [](const Component& piece) { return piece.pixels.size(); });
    if (pieces.empty()) return {};
    const auto largest = static_cast<double>(pieces[0].pixels.size());
    if (largest < kLeastFieldShare * static_cast<double>(coarse.pixels.size())) return {};
    if (pieces.size() > 1 && static_cast<double>(pieces[1].pixels.size()) > kSecondShare * largest) return {};
    BrightPiece piece;
    piece.pixels.assign(coarse.pixels.size(), false);
    for (const std::size_t i : pieces[0].pixels) piece.pixels[i] = true;
    piece.hull = convex_hull(ends_of_rows(piece.pixels, coarse));
    return piece;
}

bool on_border(const HullPoint& p, const Image& image) {
    constexpr double kBorder = 1.5;
    return p.x < kBorder || p.y < kBorder || p.x > image.width - 1 - kBorder || p.y > image.height - 1 - kBorder;
}

bool has_neighbour(const BrightPiece& piece, const Image& coarse, const HullPoint& p, int reach) {
    const int cx = static_cast<int>(std::lround(p.x)), cy = static_cast<int>(std::lround(p.y));
    for (int y = std::max(0, cy - reach); y <= std::min(coarse.height - 1, cy + reach); ++y) {
        for (int x = std::max(0, cx - reach); x <= std::min(coarse.width - 1, cx + reach); ++x) {
            if (piece.pixels[coarse.index(x, y)]) return true;
        }
    }
    return false;
}

/// Weights 0 outside the circle or hull, shrunk by `margin` (all in coarse pixels); edges along the image's border are
/// not shrunk.
template <typename Depth>
Image weights_inside(const Image& full, int factor, double margin, Depth depth) {
    Image weights(full.width, full.height, 1);
    for (int y = 0; y < full.height; ++y) {
        for (int x = 0; x < full.width; ++x) {
            const HullPoint p{(x + 0.5) / factor - 0.5, (y + 0.5) / factor - 0.5};
            if (depth(p) < margin) weights(x, y) = 0;
        }
    }
    return weights;
}

std::string percent(const Image& weights) { return text_of(100 * share_of_zeros(weights), " % of the pixels"); }

AutoMask mask_circle(const Image& full, int factor, double margin, const Circle& circle) {
    AutoMask mask{weights_inside(full, factor, margin,
                                 [&](const HullPoint& p) {
                                     return circle.radius + 0.5 - std::hypot(p.x - circle.x, p.y - circle.y);
                                 }),
                  {}};
    mask.decisions.push_back("round field, outside it " + percent(mask.weights));
    return mask;
}

/// The hull's points within the image, evenly spaced; empty where they are few or where the piece does not fill the
/// hull along most of them.
std::vector<HullPoint> seen_edge(const BrightPiece& piece, const Image& coarse) {
    constexpr double kFilledShare = 0.75;    // a body that crosses the field's edge hides the rest
    constexpr double kLeastEdgeShare = 0.1;  // of the hull's edge must lie within the image
    const std::vector<HullPoint> edge = along_hull(piece.hull, 720);
    std::vector<HullPoint> seen;
    std::ranges::copy_if(edge, std::back_inserter(seen), [&](const HullPoint& p) { return !on_border(p, coarse); });
    if (static_cast<double>(seen.size()) < kLeastEdgeShare * static_cast<double>(edge.size())) return {};
    const int reach = std::max(1, static_cast<int>(0.01 * std::min(coarse.width, coarse.height)));
    const auto filled =
        std::ranges::count_if(seen, [&](const HullPoint& p) { return has_neighbour(piece, coarse, p, reach); });
    if (static_cast<double>(filled) < kFilledShare * static_cast<double>(seen.size())) return {};
    return seen;
}

/// Sides of the simplified hull that lie within the image; 0 where it is no polygon of a collimator.
std::size_t straight_sides(const BrightPiece& piece, const Image& coarse) {
    const std::vector<HullPoint> corners = simplified(piece.hull, 0.012 * std::min(coarse.width, coarse.height));
    if (corners.size() > 10) return 0;  // 8 sides, and corners cut off by the image's border
    std::size_t sides = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const HullPoint &a = corners[i], &b = corners[(i + 1) % corners.size()];
        sides += !on_border({(a.x + b.x) / 2, (a.y + b.y) / 2}, coarse);
    }
    return sides;
}

}  // namespace

AutoMask mask_frame(const Image& intensities, const Image& weights, double least_radius_share) {
    const int factor = coarse_factor(intensities);
    const Image coarse = coarse_image(intensities, weights, factor);
    if (coarse.width < 16 || coarse.height < 16) return {};
    const BrightPiece piece = bright_piece(coarse);
    if (piece.hull.size() < 3) return {};
    const std::vector<HullPoint> seen = seen_edge(piece, coarse);
    if (seen.empty()) return {};
    // 2 px of blur; a coarse pixel of which a tenth lies in the field counts as bright.
    const double margin = 2.5 / factor + (factor > 1 ? 1.0 : 0.5);
    const double least_radius = least_radius_share * std::min(coarse.width, coarse.height);
    if (const std::optional<Circle> circle = fit_circle(seen); circle && circle->radius > least_radius) {
        return mask_circle(intensities, factor, margin, *circle);
    }
    const std::size_t sides = straight_sides(piece, coarse);
    if (sides == 0) return {};
    AutoMask mask;
    const auto is_open = [&](const HullPoint& middle) { return on_border(middle, coarse); };
    mask.weights = weights_inside(intensities, factor, margin,
                                  [&](const HullPoint& p) { return depth_in_hull(piece.hull, p, is_open); });
    mask.decisions.push_back(text_of("field of ", sides, sides == 1 ? " straight side" : " straight sides",
                                     " within the image, outside it ", percent(mask.weights)));
    return mask;
}

AutoMask mask_stepped_field(const Image& intensities, const Image& weights) {
    constexpr int kSide = 256;  // enough for a circle, and a quarter of the noise of 512
    const int factor = coarse_factor(intensities, kSide);
    const auto circle = round_field_by_its_step(coarse_image(intensities, weights, factor));
    constexpr double kUnsure = 1;  // px, of the circle
    return circle ? mask_circle(intensities, factor, 2.5 / factor + kUnsure, *circle) : AutoMask{};
}

AutoMask mask_marks(const Image& intensities, const Image& weights) {
    const int factor = coarse_factor(intensities);
    const Image coarse = coarse_image(intensities, weights, factor);
    const Range range = range_of(coarse);
    if (!(range.high > range.low)) return {};
    const int side = std::max(coarse.width, coarse.height);
    const std::vector<double> contrast = mark_contrast(coarse, range.high - range.low, std::max(4, side / 32));
    // Half the contrast outlines the whole thing: of bones and skin, more than a mark's size.
    std::vector<bool> odd(contrast.size());
    for (std::size_t i = 0; i < odd.size(); ++i) odd[i] = contrast[i] > kOutlineContrast;
    std::vector<bool> marked(coarse.pixels.size());
    std::size_t found = 0;
    for (const Component& piece : components_of(odd, coarse.width, coarse.height)) {
        const int extent = std::max(piece.high_x - piece.low_x, piece.high_y - piece.low_y) + 1;
        const auto strong = std::ranges::count_if(piece.pixels, [&](std::size_t i) { return contrast[i] > 1; });
        if (strong < 2 || extent > side / 20) continue;
        ++found;
        for (const std::size_t i : piece.pixels) marked[i] = true;
    }
    if (found == 0) return {};
    AutoMask mask{weights_without(marked, coarse, intensities, factor, 2 * factor), {}};
    mask.decisions.push_back(
        text_of(found, found == 1 ? " letter or marker, " : " letters or markers, ", percent(mask.weights)));
    return mask;
}

AutoMask mask_clipped(const Image& intensities, double max_representable) {
    constexpr double kPlateauShare = 0.005;
    float top = static_cast<float>(max_representable);
    if (max_representable <= 0) {
        top = -std::numeric_limits<float>::infinity();
        for (const float v : intensities.pixels) top = std::isfinite(v) ? std::max(top, v) : top;
    }
    std::vector<bool> clipped(intensities.pixels.size());
    std::size_t saturated = 0, zeros = 0;
    for (const float v : intensities.pixels) saturated += v >= top;
    const bool is_plateau = static_cast<double>(saturated) >= kPlateauShare * static_cast<double>(clipped.size());
    const bool use_top = saturated > 0 && (max_representable > 0 || is_plateau);
    for (std::size_t i = 0; i < clipped.size(); ++i) {
        const float v = intensities.pixels[i];
        zeros += v <= 0;
        clipped[i] = v <= 0 || (use_top && v >= top);
    }
    if (zeros == 0 && !use_top) return {};
    AutoMask mask{weights_without(clipped, intensities, intensities, 1, 1), {}};
    mask.decisions.push_back(text_of(use_top ? saturated : 0, " saturated and ", zeros,
                                     " zero pixels, with 1 px around them ", percent(mask.weights)));
    return mask;
}

}  // namespace raylign::detail
