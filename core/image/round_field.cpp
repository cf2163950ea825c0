#include "core/image/round_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/median.h"

namespace raylign::detail {
namespace {

constexpr int kStepRays = 90, kLeastSide = 64;
constexpr double kLeastStepRadius = 0.38, kMostStepRadius = 0.72;  // of the shorter side
constexpr double kCentreStep = 0.02;
constexpr int kCentreSteps = 3;  // to each side
constexpr int kStepReach = 3;    // px: the step lies between the means of three samples to either side
constexpr int kBeside = 6;       // px: where the step is compared with those beside it
constexpr float kLeastStep = 0.03F;
constexpr double kLeastRound = 0.2;  // of the circle in the image
/// Of the most. Fields of image intensifiers and of simulated C-arms had 0.75 to 1.0, where a body hid a part of the
/// edge; open panels, with knees and wrists upon them, at most 0.34.
constexpr double kLeastCounted = 0.55;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

Image logarithms(const Image& intensities) {
    std::vector<float> finite;
    std::ranges::copy_if(intensities.pixels, std::back_inserter(finite), [](float v) { return std::isfinite(v); });
    if (finite.empty()) return {};
    const auto bright = finite.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(finite.size() - 1));
    std::ranges::nth_element(finite, bright);
    const float least = 1e-3F * *bright;
    if (!(least > 0)) return {};
    Image logs(intensities.width, intensities.height);
    for (std::size_t i = 0; i < logs.pixels.size(); ++i) {
        const float v = intensities.pixels[i];
        logs.pixels[i] = std::isfinite(v) ? std::log(std::max(v, least)) : kNone;
    }
    return logs;
}

/// Standard deviation of a pixel's noise: the median difference of neighbours is hardly one of structure.
double noise_of(const Image& logs) {
    std::vector<float> differences;
    for (int y = 0; y < logs.height; ++y) {
        for (int x = 1; x < logs.width; ++x) {
            const float difference = std::abs(logs(x, y) - logs(x - 1, y));
            if (std::isfinite(difference)) differences.push_back(difference);
        }
    }
    if (differences.empty()) return 0;
    return median(std::move(differences)) / (0.6745 * std::numbers::sqrt2);
}

float sampled(const Image& image, double x, double y) {
    if (!(x >= 0 && y >= 0 && x <= image.width - 1 && y <= image.height - 1)) return kNone;
    const int i = std::min(static_cast<int>(x), image.width - 2), j = std::min(static_cast<int>(y), image.height - 2);
    const auto a = static_cast<float>(x - i), b = static_cast<float>(y - j);
    return (1 - b) * ((1 - a) * image(i, j) + a * image(i + 1, j)) +
           b * ((1 - a) * image(i, j + 1) + a * image(i + 1, j + 1));
}

/// The steps across circles about one centre: [radius][ray], radii of whole pixels from `first_px`.
struct Steps {
    HullPoint centre;
    int first_px = 0;
    std::vector<std::array<float, kStepRays>> rows;
};

HullPoint direction(int ray) {
    const double angle = 2 * std::numbers::pi * ray / kStepRays;
    return {std::cos(angle), std::sin(angle)};
}

/// Of the means of three, each less the mean of the steps beside it where that is a step down, too; NaN beyond the
/// image.
Steps steps_about(const Image& logs, const HullPoint& centre) {
    const double side = std::min(logs.width, logs.height);
    const int first = static_cast<int>(kLeastStepRadius * side), last = static_cast<int>(kMostStepRadius * side);
    const int margin = kStepReach + kBeside;
    Steps steps{centre, first, std::vector<std::array<float, kStepRays>>(last - first + 1)};
    std::vector<float> values(last - first + 1 + 2 * margin), plain(values.size(), kNone);
    for (int ray = 0; ray < kStepRays; ++ray) {
        const HullPoint along = direction(ray);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double radius = first - margin + static_cast<double>(i);
            values[i] = sampled(logs, centre.x + radius * along.x, centre.y + radius * along.y);
        }
        for (std::size_t i = kStepReach; i + kStepReach < values.size(); ++i) {
            plain[i] =
                (values[i - 3] + values[i - 2] + values[i - 1] - values[i + 1] - values[i + 2] - values[i + 3]) / 3;
        }
        for (std::size_t k = 0; k < steps.rows.size(); ++k) {
            const std::size_t i = k + margin;
            const float beside = (plain[i - kBeside] + plain[i + kBeside]) / 2;
            steps.rows[k][ray] = std::isfinite(beside) ? plain[i] - std::max(beside, 0.0F) : kNone;
        }
    }
    return steps;
}

struct Count {
    double steps = 0, seen = 0;  // of kStepRays
};

Count count_of(const std::array<float, kStepRays>& steps, float most) {
    Count count;
    for (const float step : steps) {
        if (!std::isfinite(step)) continue;
        count.steps += std::clamp(step / most, -1.0F, 1.0F) / kStepRays;
        count.seen += 1.0 / kStepRays;
    }
    return count;
}

/// Where the step is largest along each ray, near the circle of the k-th radius.
std::vector<HullPoint> edge_near(const Steps& steps, std::size_t k, float least) {
    std::vector<HullPoint> edge;
    const std::size_t from = k - std::min<std::size_t>(k, kBeside), to = std::min(steps.rows.size(), k + kBeside + 1);
    for (int ray = 0; ray < kStepRays; ++ray) {
        std::size_t best = from;
        for (std::size_t i = from; i < to; ++i) {
            if (!(steps.rows[best][ray] >= steps.rows[i][ray])) best = i;
        }
        if (!(steps.rows[best][ray] > least)) continue;
        const double radius = steps.first_px + static_cast<double>(best);
        const HullPoint along = direction(ray);
        edge.push_back({steps.centre.x + radius * along.x, steps.centre.y + radius * along.y});
    }
    return edge;
}

}  // namespace

std::optional<Circle> round_field_by_its_step(const Image& intensities) {
    const double side = std::min(intensities.width, intensities.height);
    if (side < kLeastSide) return std::nullopt;
    const Image logs = logarithms(intensities);
    if (logs.empty()) return std::nullopt;
    const auto most = std::max(static_cast<float>(3 * noise_of(logs)), kLeastStep);
    double counted = 0;
    std::vector<HullPoint> edge;
    for (int step = 0; step < (2 * kCentreSteps + 1) * (2 * kCentreSteps + 1); ++step) {
        const int across = step % (2 * kCentreSteps + 1) - kCentreSteps,
                  down = step / (2 * kCentreSteps + 1) - kCentreSteps;
        const Steps steps = steps_about(logs, {(logs.width - 1) / 2.0 + kCentreStep * side * across,
                                               (logs.height - 1) / 2.0 + kCentreStep * side * down});
        for (std::size_t k = 0; k < steps.rows.size(); ++k) {
            const Count count = count_of(steps.rows[k], most);
            if (count.steps <= counted || count.seen < kLeastRound || count.steps < kLeastCounted * count.seen)
                continue;
            counted = count.steps;
            edge = edge_near(steps, k, most);
        }
    }
    return fit_circle(edge);
}

}  // namespace raylign::detail
