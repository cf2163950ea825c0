#pragma once

#include <cstdint>
#include <vector>

#include "backends/cpu/kernel_types.h"
#include "core/backend.h"

namespace raylign::detail::cpu {

/// The dominant axes that the rays of a frame have: bit i for axis i. Those in `known` are not looked for.
[[nodiscard]] unsigned axes_met(const RayFrame& frame, const Eigen::Vector2i& size_px, unsigned known);

/// Everything of a CastJob that one frame decides: geometry and image size.
[[nodiscard]] CastJob cast_job(const RayFrame& frame, const Eigen::Vector2i& size_px, const VoxelGrid& grid);

[[nodiscard]] FrameDerivatives frame_derivatives(const RayFrameDerivatives& derivatives);

/// What a view brings to the sums, laid out for the kernels: rows of `stride` floats, zero beyond the width.
struct ViewPlan {
    Eigen::Vector2i size_px;
    std::ptrdiff_t stride = 0;
    std::vector<std::vector<float>> fixed;
    std::vector<float> weights;
    std::vector<MomentSums> fixed_sums;  ///< the three sums that no pose changes
    std::vector<std::uint8_t> needed;    ///< per kNeedPx square: reaches a pixel with weight; empty: all do
    std::ptrdiff_t needed_stride = 0;

    [[nodiscard]] int tiles_x() const { return (size_px.x() + kTilePx - 1) / kTilePx; }
    [[nodiscard]] int tiles() const { return tiles_x() * ((size_px.y() + kTilePx - 1) / kTilePx); }
    [[nodiscard]] int bands_x() const { return (size_px.x() + kBandColumns - 1) / kBandColumns; }
    /// Half of the image's at most, so that threads find enough bands; by the image alone.
    [[nodiscard]] int band_rows() const;
    [[nodiscard]] int bands() const { return bands_x() * ((size_px.y() + band_rows() - 1) / band_rows()); }
    /// From an image to its next derivative: not so that all fall into the same sets of a cache.
    [[nodiscard]] std::size_t image_floats() const { return static_cast<std::size_t>(stride) * size_px.y() + 80; }
};
[[nodiscard]] ViewPlan make_view_plan(const Eigen::Vector2i& size_px);

/// Floats of scratch that a BandJob needs: a padded row, two row-filtered images of a stretch and its surroundings.
[[nodiscard]] std::size_t band_scratch_floats(int radius);
/// The same with derivatives: for seven images, and the gradients of a stretch of each.
[[nodiscard]] std::size_t derivative_scratch_floats(int radius);
/// The first of `floats` on a cache line, which leaves out kAlignFloats at most.
constexpr std::size_t kAlignFloats = 15;
[[nodiscard]] float* on_cache_line(float* floats);

/// The fixed channels of a view, which never change.
void plan_channels(ViewPlan& plan, const FixedChannels& fixed);
/// The weights, and all that follows from them. `reach_px`: how far a pixel of the DRR reaches in the channels (the
/// filter's radius).
void plan_weights(ViewPlan& plan, const FixedChannels& fixed, int reach_px);

}  // namespace raylign::detail::cpu
