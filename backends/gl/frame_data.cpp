#include "backends/gl/frame_data.h"

#include <algorithm>
#include <bit>

#include "core/geometry/dominant_axis.h"

namespace raylign::detail::gl {
namespace {

constexpr double kFarAway_mm = 1e30;  ///< stands for infinity, also a ceiling's: inf times 0 would be NaN

shared::vec4 vec4(const Eigen::Vector3d& v, double w = 0) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w)};
}

Eigen::Vector2d centre_px(const FrameContext& context) {
    return (context.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
}

/// Depth at which the ray through the image's centre is nearest to the volume's centre.
double near_depth_mm(const RayFrame& frame, const FrameContext& context) {
    const Eigen::Vector2d px = centre_px(context);
    const Eigen::Vector3d ray = frame.ray_voxel(px.x(), px.y());
    const Eigen::Vector3d centre =
        context.first_voxel.cast<double>() + (context.size_voxels.cast<double>() - Eigen::Vector3d::Ones()) / 2;
    return (centre - frame.source_voxel).dot(ray) / ray.squaredNorm();
}

}  // namespace

shared::FrameData frame_data(const RayFrame& frame, const FrameContext& context) {
    const Eigen::Vector2d px = centre_px(context);
    const Eigen::Vector3d ray = frame.ray_voxel(px.x(), px.y());
    const double depth_mm = near_depth_mm(frame, context);
    const auto ceiling = static_cast<float>(std::min(frame.ceiling, kFarAway_mm));
    const Eigen::Vector3d position = frame.source_voxel + depth_mm * ray - context.first_voxel.cast<double>();
    return {vec4(position, depth_mm),
            vec4(ray, std::min(frame.depth_max_mm - depth_mm, kFarAway_mm)),
            vec4(frame.step_u_voxel),
            vec4(frame.step_v_voxel),
            {frame.view, std::bit_cast<std::uint32_t>(ceiling), 0, 0}};
}

shared::DerivativeData derivative_data(const RayFrame& frame, const RayFrameDerivatives& derivatives,
                                       const FrameContext& context) {
    const Eigen::Vector2d px = centre_px(context);
    const double depth_mm = near_depth_mm(frame, context);
    shared::DerivativeData data;
    for (std::size_t i = 0; i < derivatives.size(); ++i) {
        const RayFrameDerivative& d = derivatives[i];
        const Eigen::Vector3d ray = d.ray_voxel(px.x(), px.y());
        data.parameters[i] = {vec4(d.source_voxel + depth_mm * ray), vec4(ray), vec4(d.step_u_voxel),
                              vec4(d.step_v_voxel)};
    }
    return data;
}

unsigned axes_met(const RayFrame& frame, const Eigen::Vector2i& size_px) {
    // Directions are affine in the pixel: an axis whose length at every corner is below a bound that another exceeds at
    // every corner is nowhere dominant.
    Eigen::Array3d low = frame.ray_voxel(0, 0), high = low;
    for (const int u : {0, size_px.x() - 1}) {
        for (const int v : {0, size_px.y() - 1}) {
            const Eigen::Array3d ray = frame.ray_voxel(u, v).array();
            low = low.min(ray);
            high = high.max(ray);
        }
    }
    const Eigen::Array3d longest = low.abs().max(high.abs()), shortest = low.max(-high).max(0);
    unsigned possible = 0;
    for (int axis = 0; axis < 3; ++axis) {
        // Twice the bias: floats may choose the neighbour of what doubles choose.
        if (!(shortest.maxCoeff() > longest[axis] * (1 + 2 * kAxisBias))) possible |= 1U << axis;
    }
    return possible;
}

}  // namespace raylign::detail::gl
