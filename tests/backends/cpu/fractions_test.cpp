// What int16 arithmetic adds to the rounding of voxels: fractions of 15 bits along a row
// (backends/cpu/footprint_avx2.h, footprint_neon.h). Voxels here are whole multiples of the unit, so that storing them
// loses nothing.
#include <algorithm>
#include <cmath>

#include "cpu_scenes.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::test {
namespace {

constexpr float kUnit = 0x1p-20F;  // per mm; the largest voxel is 32767 of them
constexpr double kLargest = 32767 * static_cast<double>(kUnit);

class CpuFractions : public testing::TestWithParam<std::string> {
protected:
    [[nodiscard]] std::unique_ptr<Session> session(const NamedScene& named) const {
        return make_cpu_backend(
                   {.threads = 2, .instruction_set = instruction_set_from_name(GetParam()), .storage = Storage::int16})
            ->prepare(named.scene(Projector::joseph));
    }
    [[nodiscard]] static std::unique_ptr<Session> reference(const NamedScene& named) {
        return make_reference_backend()->prepare(named.scene(Projector::joseph));
    }
};

/// Nothing up to the middle along `axis`, from there on the largest voxel: the steepest step there is.
NamedScene edge_scene(int axis) {
    NamedScene named{"edge",
                     random_volume({40, 40, 40}, {1, 1, 1}, 1),
                     // Rays along z from so far that each keeps its fraction all the way: errors add up, they do not
                     // cancel. The pixels of the edge have many fractions.
                     {view_along(Eigen::Matrix3d::Identity(), {220, 220}, 0.013, 1e7, 1e7 + 100)}};
    for (int z = 0; z < 40; ++z) {
        for (int y = 0; y < 40; ++y) {
            for (int x = 0; x < 40; ++x) {
                const bool full = (axis == 0 ? x : y) >= 20;
                named.volume.attenuation_per_mm[named.volume.index(x, y, z)] = full ? 32767 * kUnit : 0;
            }
        }
    }
    return named;
}

struct Errors {
    double largest = 0, mean = 0;  ///< of a voxel's step times the path
};
Errors errors(const Image& image, const Image& truth) {
    Errors errors;
    const double step = 40 * kLargest;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double error = (image.pixels[i] - truth.pixels[i]) / step;
        errors.largest = std::max(errors.largest, std::abs(error));
        errors.mean += error / static_cast<double>(image.pixels.size());
    }
    return errors;
}

TEST_P(CpuFractions, AlongARowAreOffBy15BitsAtMostAndByNothingOnAverage) {
    const NamedScene named = edge_scene(0);
    const Image image = session(named)->render({}, 0), truth = reference(named)->render({}, 0);
    const auto [low, high] = std::ranges::minmax(truth.pixels);
    ASSERT_LT(low, 0.1 * 40 * kLargest);
    ASSERT_GT(high, 0.9 * 40 * kLargest);
    const Errors found = errors(image, truth);
    EXPECT_LE(found.largest, kInt16FractionShare);
    EXPECT_LE(std::abs(found.mean), 0.1 * kInt16FractionShare);
}

TEST_P(CpuFractions, AcrossRowsAreThoseOfFloats) {
    const NamedScene named = edge_scene(1);
    const Errors found = errors(session(named)->render({}, 0), reference(named)->render({}, 0));
    EXPECT_LE(found.largest, 0.2 * kInt16FractionShare);
}

/// Whatever the size of the footprint: pixels from a fifth of a voxel to three voxels apart.
TEST_P(CpuFractions, OfNoiseCancelAlongRaysInFootprintsOfEverySize) {
    NamedScene named{"noise", random_volume({64, 60, 56}, {1, 1, 1}, 3), {}};
    for (float& voxel : named.volume.attenuation_per_mm) voxel = std::round(voxel / 0.04F * 32767) * kUnit;
    named.volume.attenuation_per_mm.front() = 32767 * kUnit;
    for (const double pitch_mm : {0.3, 1.5, 2.2, 3.1, 4.5}) {
        for (const Eigen::Matrix3d& direction : {rotation(20, 30, 10), rotation(70, 10, 50), rotation(10, 80, 33)}) {
            named.views.push_back(view_along(direction, {45, 37}, pitch_mm));
        }
    }
    const auto ours = session(named), exact = reference(named);
    for (std::size_t view = 0; view < named.views.size(); ++view) {
        const Image image = ours->render(pose_near_identity(4, 0.3), view),
                    truth = exact->render(pose_near_identity(4, 0.3), view);
        const float maximum = *std::ranges::max_element(truth.pixels);
        for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
            ASSERT_NEAR(image.pixels[i], truth.pixels[i], kFloatImageShare * maximum) << view << ": " << i;
        }
    }
}

/// A field so smooth that its kinks on voxel planes do not show; no ray comes near its sides.
TEST_P(CpuFractions, DerivativeImagesEqualTheReference) {
    NamedScene named{"smooth", random_volume({48, 48, 48}, {1, 1, 1}, 1), {}};
    for (int z = 0; z < 48; ++z) {
        for (int y = 0; y < 48; ++y) {
            for (int x = 0; x < 48; ++x) {
                named.volume.attenuation_per_mm[named.volume.index(x, y, z)] =
                    static_cast<float>(4000 + 300 * x - 70 * y + 150 * z + (x - 20) * (y - 11) / 4) * kUnit;
            }
        }
    }
    named.volume.attenuation_per_mm.front() = 32767 * kUnit;  // in a corner that no ray meets: the unit is kUnit
    for (const double pitch_mm : {0.7, 1.5, 2.1}) {
        for (const Eigen::Matrix3d& direction : {rotation(8, 5, 10), rotation(85, 4, 8), rotation(5, 83, 6)}) {
            named.views.push_back(view_along(direction, {9, 11}, pitch_mm));
        }
    }
    const auto ours = session(named), exact = reference(named);
    for (std::size_t view = 0; view < named.views.size(); ++view) {
        const auto found = ours->render_with_derivatives({}, {2, -3, 1}, view),
                   truth = exact->render_with_derivatives({}, {2, -3, 1}, view);
        for (std::size_t p = 0; p < truth.derivatives.size(); ++p) {
            const std::vector<float>&a = found.derivatives[p].pixels, &b = truth.derivatives[p].pixels;
            const auto [low, high] = std::ranges::minmax(b);
            for (std::size_t i = 0; i < b.size(); ++i) {
                ASSERT_NEAR(a[i], b[i], 3e-4 * std::max(std::abs(low), std::abs(high)))
                    << view << " " << p << ": " << i;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, CpuFractions, testing::ValuesIn(available_sets()),
                         [](const testing::TestParamInfo<std::string>& test) { return test.param; });

}  // namespace
}  // namespace raylign::detail::test
