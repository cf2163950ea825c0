#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace raylign::detail {

/// SplitMix64 [Steele, Lea, Flood 2014]: a small generator whose numbers are the same on every machine. std::mt19937
/// is, too, but the standard's distributions are not: each library samples in its own way. Period 2^64; not for
/// secrets.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    [[nodiscard]] std::uint64_t bits() {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
        return z ^ (z >> 31);
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    [[nodiscard]] double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

    /// Uniform in [low, high).
    [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }

    /// Uniform on the unit sphere: Marsaglia 1972. Only arithmetic and square roots, so the same to the last bit
    /// everywhere.
    [[nodiscard]] Eigen::Vector3d direction() {
        const DiscPoint p = disc_point();
        const double h = 2 * std::sqrt(1 - p.norm2);
        return {p.x * h, p.y * h, 1 - 2 * p.norm2};
    }

    /// Standard normal: Marsaglia's polar method, one value used. The same on every machine up to the last bit of its
    /// log().
    [[nodiscard]] double normal() {
        const DiscPoint p = disc_point();
        return p.x * std::sqrt(-2 * std::log(p.norm2) / p.norm2);
    }

private:
    struct DiscPoint {
        double x, y, norm2;
    };
    /// Uniform in the unit disc, without its centre.
    [[nodiscard]] DiscPoint disc_point() {
        for (;;) {
            const double x = uniform(-1, 1), y = uniform(-1, 1);
            const double norm2 = x * x + y * y;
            if (norm2 > 0 && norm2 < 1) return {x, y, norm2};
        }
    }

    std::uint64_t state_;
};

}  // namespace raylign::detail
