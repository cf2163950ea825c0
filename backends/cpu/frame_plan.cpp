#include "backends/cpu/frame_plan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>

#include "core/geometry/dominant_axis.h"

namespace raylign::detail::cpu {
namespace {

std::vector<float> with_stride(const Image& image, std::ptrdiff_t stride) {
    std::vector<float> out(static_cast<std::size_t>(stride) * image.height, 0.F);
    for (int y = 0; y < image.height; ++y) {
        std::copy_n(image.pixels.begin() + std::ptrdiff_t{y} * image.width, image.width, out.begin() + y * stride);
    }
    return out;
}

/// The box around the pixels with weight in the square of kNeedPx that begins at (x, y).
Eigen::AlignedBox2i weighted_box(const Image& weights, int x, int y) {
    Eigen::AlignedBox2i box;
    for (int v = y; v < std::min(y + kNeedPx, weights.height); ++v) {
        for (int u = x; u < std::min(x + kNeedPx, weights.width); ++u) {
            if (weights(u, v) != 0) box.extend(Eigen::Vector2i(u, v));
        }
    }
    return box;
}

}  // namespace

unsigned axes_met(const RayFrame& frame, const Eigen::Vector2i& size_px, unsigned known) {
    // Directions are affine in the pixel: their bounds over the image are those of its corners.
    Eigen::Array3d low = frame.ray_voxel(0, 0), high = low;
    for (const int u : {0, size_px.x() - 1}) {
        for (const int v : {0, size_px.y() - 1}) {
            const Eigen::Array3d ray = frame.ray_voxel(u, v).array();
            low = low.min(ray);
            high = high.max(ray);
        }
    }
    const Eigen::Array3d longest = low.abs().max(high.abs());
    const Eigen::Array3d shortest = low.max(-high).max(0);
    unsigned possible = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (!(shortest.maxCoeff() > longest[axis] * (1 + 4 * kAxisBias))) possible |= 1U << axis;
    }
    const unsigned wanted = possible & ~known;
    if (wanted == 0 || std::has_single_bit(possible)) return wanted;
    unsigned met = 0;
    for (int v = 0; v < size_px.y() && (met & wanted) != wanted; ++v) {
        for (int u = 0; u < size_px.x(); ++u) met |= 1U << dominant_axis(frame.ray_voxel(u, v));
    }
    return met & wanted;
}

FrameDerivatives frame_derivatives(const RayFrameDerivatives& derivatives) {
    FrameDerivatives floats;
    for (int p = 0; p < kParameters; ++p) {
        const RayFrameDerivative& d = derivatives[p];
        for (int axis = 0; axis < 3; ++axis) {
            floats.source[p][axis] = static_cast<float>(d.source_voxel[axis]);
            floats.direction[p][axis] = static_cast<float>(d.direction_voxel[axis]);
            floats.step_u[p][axis] = static_cast<float>(d.step_u_voxel[axis]);
            floats.step_v[p][axis] = static_cast<float>(d.step_v_voxel[axis]);
        }
    }
    return floats;
}

CastJob cast_job(const RayFrame& frame, const Eigen::Vector2i& size_px, const VoxelGrid& grid) {
    CastJob job{};
    for (int axis = 0; axis < 3; ++axis) {
        job.source[axis] = frame.source_voxel[axis];
        job.direction[axis] = frame.direction_voxel[axis];
        job.step_u[axis] = frame.step_u_voxel[axis];
        job.step_v[axis] = frame.step_v_voxel[axis];
        job.spacing_mm[axis] = grid.spacing_mm[axis];
    }
    job.depth_max_mm = frame.depth_max_mm;
    job.axis_ratio = 1 + kAxisBias;
    job.width = size_px.x();
    job.height = size_px.y();
    return job;
}

ViewPlan make_view_plan(const Eigen::Vector2i& size_px) {
    ViewPlan plan;
    plan.size_px = size_px;
    plan.stride = (static_cast<std::ptrdiff_t>(size_px.x()) + 15) / 16 * 16;
    return plan;
}

int ViewPlan::band_rows() const {
    const int half = (size_px.y() + 1) / 2;
    return std::clamp((half + kStretchRows - 1) / kStretchRows * kStretchRows, kStretchRows, kBandRows);
}

std::size_t band_scratch_floats(int radius) {
    const std::size_t reach = 2 * static_cast<std::size_t>(radius);
    return kBandColumns + (reach + 15) / 16 * 16 + std::size_t{2} * kBandColumns * (kStretchRows + reach);
}

std::size_t derivative_scratch_floats(int radius) {
    constexpr int kGradients = 2 * kGradientFloats;
    return (1 + kParameters) * (band_scratch_floats(radius) + kGradients);
}

float* on_cache_line(float* floats) {
    const std::size_t line = kAlignFloats + 1, at = reinterpret_cast<std::uintptr_t>(floats) / sizeof(float);
    return floats + (line - at % line) % line;
}

void plan_channels(ViewPlan& plan, const FixedChannels& fixed) {
    for (const Image& channel : fixed.channels) plan.fixed.push_back(with_stride(channel, plan.stride));
}

void plan_weights(ViewPlan& plan, const FixedChannels& fixed, int reach_px) {
    plan.fixed_sums.clear();
    for (const Image& channel : fixed.channels) plan.fixed_sums.push_back(moment_sums(channel, channel, fixed.weights));
    plan.weights = with_stride(fixed.weights, plan.stride);
    const int width = plan.size_px.x(), height = plan.size_px.y();
    plan.needed_stride = (width + kNeedPx - 1) / kNeedPx;
    plan.needed.assign(plan.needed_stride * ((height + kNeedPx - 1) / kNeedPx), 0);
    for (int y = 0; y < height; y += kNeedPx) {
        for (int x = 0; x < width; x += kNeedPx) {
            const Eigen::AlignedBox2i box = weighted_box(fixed.weights, x, y);
            if (box.isEmpty()) continue;
            const int x0 = std::max(box.min().x() - reach_px, 0), x1 = std::min(box.max().x() + reach_px, width - 1);
            const int y0 = std::max(box.min().y() - reach_px, 0), y1 = std::min(box.max().y() + reach_px, height - 1);
            for (int row = y0 / kNeedPx; row <= y1 / kNeedPx; ++row) {
                std::fill(plan.needed.begin() + row * plan.needed_stride + x0 / kNeedPx,
                          plan.needed.begin() + row * plan.needed_stride + x1 / kNeedPx + 1, 1);
            }
        }
    }
    if (std::ranges::count(plan.needed, 0) == 0) plan.needed.clear();
}

}  // namespace raylign::detail::cpu
