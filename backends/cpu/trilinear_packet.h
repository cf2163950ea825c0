#pragma once

#include "backends/cpu/joseph_packet.h"

namespace raylign::detail::cpu {
namespace {

/// The rays of a packet as sample positions. Arrays of three are in the layout's order: plane, row, column.
template <class Arch>
struct alignas(64) TrilinearPacket {
    static constexpr int count = Lanes<Arch>::count;
    double start[3][count], step[3][count];  ///< voxel coordinates of sample k: start + k * step
    double end[count];                       ///< samples from this one on do not count
    float depth_per_step[count];             ///< mm
    float sum[count];
    float gradient[3][count], moment[3][count];  ///< sums of the field's slopes, and of the same times (k + 1/2)
    double first, last;                          ///< samples [first, last) meet the volume
    double row_line, row_spread, column_line, column_spread;  ///< as in JosephPacket, where taken plane by plane
    int x, y;
    unsigned lanes;
    bool limited;  ///< some `end` is finite
};

/// Plane by plane, a faster way than sample by sample, where the instruction set has one (trilinear_avx512.h).
template <class Arch>
struct TrilinearFootprint {
    static constexpr bool available = false;
    static constexpr int most_parts = 1;

    /// Makes `packet` one or several that march() can take, and returns how many; 0 where it cannot.
    static int split(const PlaneLayout&, const double*, TrilinearPacket<Arch>*) { return 0; }
    template <class Voxel, Order order>
    static void march(const PlaneLayout&, TrilinearPacket<Arch>&, const SlabPart&) {}
};

/// The number of samples with (k + 1/2) depth_per_step < end, by the very comparison of the reference.
inline double sample_end(double end, double depth_per_step) {
    double k = maximum(0, __builtin_floor(end / depth_per_step - 0.5));
    while (k > 0 && !((k - 0.5) * depth_per_step < end)) --k;
    while ((k + 0.5) * depth_per_step < end) ++k;
    return k;
}

/// Depths at which a ray is inside the support (-1, n)^3, from the source on; empty if begin >= end.
template <class Rays>
void clip(const CastJob& job, int axis, const Rays& rays, int lane, double& begin, double& end) {
    const PlaneLayout& layout = job.layouts[axis];
    const int sizes[3] = {layout.planes, layout.rows, layout.columns};
    begin = 0;
    end = __builtin_inf();
    for (int i = 0; i < 3; ++i) {
        const double source = job.source[kAxisOrder[axis][i]], r = rays.ray[kAxisOrder[axis][i]][lane];
        const double low = -1 - source, high = sizes[i] - source;
        if (r == 0) {  // parallel: inside everywhere or nowhere
            if (!(low < 0 && high > 0)) end = 0;
            continue;
        }
        const double a = low / r, b = high / r;
        begin = maximum(begin, minimum(a, b));
        end = minimum(end, maximum(a, b));
    }
}

template <class Arch, class Rays>
void set_samples(const CastJob& job, int axis, const Rays& rays, TrilinearPacket<Arch>& packet) {
    packet.first = 1e300;
    packet.last = 0;
    packet.limited = false;
    for (int i = 0; i < packet.count; ++i) {
        const double mx = job.spacing_mm[0] * rays.ray[0][i], my = job.spacing_mm[1] * rays.ray[1][i],
                     mz = job.spacing_mm[2] * rays.ray[2][i];
        const double depth_per_step = job.step_mm / __builtin_sqrt(mx * mx + my * my + mz * mz);
        packet.depth_per_step[i] = static_cast<float>(depth_per_step);
        for (int k = 0; k < 3; ++k) {
            packet.step[k][i] = depth_per_step * rays.ray[kAxisOrder[axis][k]][i];
            packet.start[k][i] = job.source[kAxisOrder[axis][k]] + 0.5 * packet.step[k][i];
            packet.gradient[k][i] = packet.moment[k][i] = 0;
        }
        packet.sum[i] = 0;
        packet.end[i] = __builtin_inf();
        double begin, end;
        clip(job, axis, rays, i, begin, end);
        if (end > job.depth_max_mm) {  // the detector stands in the volume or before it
            end = job.depth_max_mm;
            packet.limited = true;
            packet.end[i] = begin < end ? sample_end(end, depth_per_step) : 0;
        }
        if (!(begin < end)) continue;
        packet.first = minimum(packet.first, maximum(0, __builtin_floor(begin / depth_per_step - 0.5)));
        packet.last = maximum(packet.last, sample_end(end, depth_per_step));
    }
}

/// dI = step sum_k grad f . (ds + depth_k dray): a sample's distance from the source is fixed, so it moves with the
/// ray. See march_trilinear of the reference.
template <class Packet>
void store_trilinear_derivatives(const CastJob& job, int axis, const Packet& packet) {
    constexpr int count = Packet::count, width = count >= 8 ? 4 : 2;
    const FrameDerivatives& d = *job.derivatives;
    const float scale = static_cast<float>(job.step_mm) * job.layouts[axis].unit_per_mm;
    for (int p = 0; p < kParameters; ++p) {
        float image[count] = {};
        for (int k = 0; k < 3; ++k) {
            const int a = kAxisOrder[axis][k];
            for (int i = 0; i < count; ++i) {
                const int x = packet.x + i % width, y = packet.y + i / width;
                const float u = static_cast<float>(x), v = static_cast<float>(y);
                const float dray = d.direction[p][a] + u * d.step_u[p][a] + v * d.step_v[p][a];
                image[i] +=
                    packet.gradient[k][i] * d.source[p][a] + packet.depth_per_step[i] * packet.moment[k][i] * dray;
            }
        }
        for (float& pixel : image) pixel *= scale;
        store_pixels(packet, image, job.image + (1 + p) * job.image_distance, job.image_stride);
    }
}

}  // namespace
}  // namespace raylign::detail::cpu
