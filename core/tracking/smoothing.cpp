#include "core/tracking/smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/base/error.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kFewestPoses = 4;  // three have one second difference
constexpr int kSteps = 20;               // of Gauss-Newton, at most
constexpr double kSmallest_rad = 1e-12;

using Vectors = std::vector<Eigen::Vector3d>;

Eigen::Vector3d turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
    return log(RigidTransform{from.transpose() * to, Eigen::Vector3d::Zero()}).head<3>();
}

Eigen::Matrix3d turned(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& turn) {
    Twist twist = Twist::Zero();
    twist.head<3>() = turn;
    return rotation * exp(twist).rotation;
}

/// (W + lambda D^T D) x = b, D the second differences: bands of width two, factored as L D L^T.
class SmoothingSystem {
public:
    SmoothingSystem(const std::vector<double>& weights, double lambda) : rows_(weights.size()) {
        const std::size_t n = weights.size();
        for (std::size_t i = 0; i < n; ++i) rows_[i][0] = weights[i];
        constexpr std::array<double, 3> kSecond{1, -2, 1};
        for (std::size_t k = 0; k + 2 < n; ++k) {
            for (std::size_t a = 0; a < 3; ++a) {
                for (std::size_t b = a; b < 3; ++b) rows_[k + a][b - a] += lambda * kSecond[a] * kSecond[b];
            }
        }
        for (std::size_t i = 0; i < n; ++i) {  // rows_[i] = pivot, L(i + 1, i), L(i + 2, i)
            const double first = rows_[i][1], second = rows_[i][2], pivot = rows_[i][0];
            rows_[i][1] = first / pivot;
            rows_[i][2] = second / pivot;
            if (i + 1 < n) {
                rows_[i + 1][0] -= rows_[i][1] * first;
                rows_[i + 1][1] -= rows_[i][1] * second;
            }
            if (i + 2 < n) rows_[i + 2][0] -= rows_[i][2] * second;
        }
    }

    [[nodiscard]] Vectors solve(Vectors b) const {
        const std::size_t n = b.size();
        for (std::size_t i = 0; i < n; ++i) {
            if (i + 1 < n) b[i + 1] -= rows_[i][1] * b[i];
            if (i + 2 < n) b[i + 2] -= rows_[i][2] * b[i];
        }
        for (std::size_t i = n; i-- > 0;) {
            b[i] /= rows_[i][0];
            if (i + 1 < n) b[i] -= rows_[i][1] * b[i + 1];
            if (i + 2 < n) b[i] -= rows_[i][2] * b[i + 2];
        }
        return b;
    }

private:
    std::vector<std::array<double, 3>> rows_;
};

/// Inner frames of `values` as second differences, D^T of them added to `sums`.
void add_transposed_differences(const Vectors& second, double factor, Vectors& sums) {
    for (std::size_t k = 0; k < second.size(); ++k) {
        sums[k] += factor * second[k];
        sums[k + 1] -= 2 * factor * second[k];
        sums[k + 2] += factor * second[k];
    }
}

/// One of the two problems: data, and what a strength makes of them with its sum of squares.
struct Smoothed {
    Vectors places;
    std::vector<Eigen::Matrix3d> rotations;
    double squares = 0;  ///< weighted, of the residuals
};

Smoothed smooth_places(const Vectors& x, const std::vector<double>& weights, double lambda) {
    Vectors b;
    for (std::size_t k = 0; k < x.size(); ++k) b.push_back(weights[k] * x[k]);
    Smoothed found{SmoothingSystem(weights, lambda).solve(std::move(b)), {}, 0};
    for (std::size_t k = 0; k < x.size(); ++k) found.squares += weights[k] * (found.places[k] - x[k]).squaredNorm();
    return found;
}

Smoothed smooth_rotations(const std::vector<Eigen::Matrix3d>& r, const std::vector<double>& weights, double mu) {
    const SmoothingSystem system(weights, mu);
    Smoothed found{{}, r, 0};
    for (int step = 0; step < kSteps; ++step) {
        Vectors b, speeds, second;
        for (std::size_t k = 0; k < r.size(); ++k) b.push_back(-weights[k] * turn_between(r[k], found.rotations[k]));
        for (std::size_t k = 0; k + 1 < r.size(); ++k) {
            speeds.push_back(turn_between(found.rotations[k], found.rotations[k + 1]));
        }
        for (std::size_t k = 0; k + 1 < speeds.size(); ++k) second.push_back(speeds[k + 1] - speeds[k]);
        add_transposed_differences(second, -mu, b);
        const Vectors change = system.solve(std::move(b));
        double largest = 0;
        for (std::size_t k = 0; k < r.size(); ++k) {
            found.rotations[k] = turned(found.rotations[k], change[k]);
            largest = std::max(largest, change[k].norm());
        }
        if (largest < kSmallest_rad) break;
    }
    for (std::size_t k = 0; k < r.size(); ++k) {
        found.squares += weights[k] * turn_between(r[k], found.rotations[k]).squaredNorm();
    }
    return found;
}

/// The strength of the least generalised cross-validation, n RSS / (n - trace)^2.
template <class Smooth>
double chosen_strength(std::size_t frames, std::size_t poses, const Smooth& smooth) {
    double best = 0, least = std::numeric_limits<double>::infinity();
    for (double power = -3; power <= 6; power += 0.5) {
        const double strength = std::pow(10, power);
        double trace = 0;
        for (std::size_t j = 0; j < frames; ++j) {
            const double wave =
                2 - 2 * std::cos(std::numbers::pi * static_cast<double>(j) / static_cast<double>(frames));
            trace += 1 / (1 + strength * wave * wave);
        }
        const double free = static_cast<double>(poses) * (1 - trace / static_cast<double>(frames));
        const double score = static_cast<double>(poses) * smooth(strength).squares / (free * free);
        if (score < least) {
            least = score;
            best = strength;
        }
    }
    return best;
}

/// Gaps get what lies between their neighbours, and no weight.
std::vector<RigidTransform> without_gaps(std::span<const TrackSample> track, std::size_t first, std::size_t last) {
    std::vector<RigidTransform> poses;
    std::size_t before = first, after = first;
    for (std::size_t k = first; k <= last; ++k) {
        if (track[k].world_from_ct) before = k;
        while (after < k || !track[after].world_from_ct) ++after;
        const RigidTransform &a = *track[before].world_from_ct, &b = *track[after].world_from_ct;
        const double share = after > before ? static_cast<double>(k - before) / static_cast<double>(after - before) : 0;
        poses.push_back({turned(a.rotation, share * turn_between(a.rotation, b.rotation)),
                         a.translation_mm + share * (b.translation_mm - a.translation_mm)});
    }
    return poses;
}

}  // namespace

SmoothTrack smoothed(std::span<const TrackSample> track, const Eigen::Vector3d& point_ct_mm,
                     std::optional<double> strength) {
    SmoothTrack result;
    std::size_t poses = 0, first = track.size(), last = 0;
    for (std::size_t k = 0; k < track.size(); ++k) {
        result.world_from_ct.push_back(track[k].world_from_ct);
        if (!track[k].world_from_ct) continue;
        if (!(track[k].sigma > 0)) throw bad_value("sigma", std::to_string(track[k].sigma), "positive", "smoothing");
        first = std::min(first, k);
        last = k;
        ++poses;
    }
    if (poses < kFewestPoses) return result;
    const std::vector<RigidTransform> filled = without_gaps(track, first, last);
    std::vector<double> weights;
    double sum = 0;
    for (std::size_t k = first; k <= last; ++k) {
        weights.push_back(track[k].world_from_ct ? 1 / (track[k].sigma * track[k].sigma) : 0);
        sum += weights.back();
    }
    for (double& weight : weights) weight *= static_cast<double>(poses) / sum;
    Vectors places;
    std::vector<Eigen::Matrix3d> rotations;
    for (const RigidTransform& pose : filled) {
        places.push_back(pose * point_ct_mm);
        rotations.push_back(pose.rotation);
    }
    const auto of_places = [&](double lambda) { return smooth_places(places, weights, lambda); };
    const auto of_rotations = [&](double mu) { return smooth_rotations(rotations, weights, mu); };
    result.translation_strength = strength ? *strength : chosen_strength(filled.size(), poses, of_places);
    result.rotation_strength = strength ? *strength : chosen_strength(filled.size(), poses, of_rotations);
    const Smoothed y = of_places(result.translation_strength), s = of_rotations(result.rotation_strength);
    for (std::size_t k = first; k <= last; ++k) {
        if (!track[k].world_from_ct) continue;
        const Eigen::Matrix3d& rotation = s.rotations[k - first];
        result.world_from_ct[k] = RigidTransform{rotation, y.places[k - first] - rotation * point_ct_mm};
    }
    return result;
}

TrackJitter jitter_of(std::span<const TrackSample> track, const Eigen::Vector3d& point_ct_mm) {
    constexpr double kVariances = 6, kAxes = 3;
    TrackJitter jitter;
    double squares_mm2 = 0, squares_rad2 = 0;
    for (std::size_t k = 1; k + 1 < track.size(); ++k) {
        const auto &a = track[k - 1].world_from_ct, &b = track[k].world_from_ct, &c = track[k + 1].world_from_ct;
        if (!a || !b || !c) continue;
        ++jitter.count;
        squares_mm2 += (*c * point_ct_mm - 2 * (*b * point_ct_mm) + *a * point_ct_mm).squaredNorm();
        squares_rad2 += (turn_between(b->rotation, c->rotation) - turn_between(a->rotation, b->rotation)).squaredNorm();
    }
    if (jitter.count == 0) return jitter;
    const double share = 1 / (kVariances * kAxes * static_cast<double>(jitter.count));
    jitter.translation_mm = std::sqrt(squares_mm2 * share);
    jitter.rotation_deg = std::sqrt(squares_rad2 * share) * 180 / std::numbers::pi;
    return jitter;
}

}  // namespace raylign::detail
