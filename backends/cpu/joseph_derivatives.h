#pragma once

#include "backends/cpu/joseph_packet.h"
#include "backends/cpu/pairs.h"

namespace raylign::detail::cpu {
namespace {

/// The four voxels around a sample in a plane.
template <class Floats>
struct Cell {
    Floats v00, v01, v10, v11;  ///< [row][column]

    [[nodiscard]] Floats value(const Floats& fr, const Floats& fc) const {
        const Floats v0 = fused(fc, v01 - v00, v00), v1 = fused(fc, v11 - v10, v10);
        return fused(fr, v1 - v0, v0);
    }
    [[nodiscard]] Floats row_slope(const Floats& fc) const {
        return fused(fc, v11 - v10, v10) - fused(fc, v01 - v00, v00);
    }
    [[nodiscard]] Floats column_slope(const Floats& fr) const {
        return fused(fr, (v11 - v10) - (v01 - v00), v01 - v00);
    }

    /// Zero where `mask` is false.
    template <class Mask>
    void keep(const Mask& mask) {
        const Floats zero(0.F);
        v00 = xsimd::select(mask, v00, zero);
        v01 = xsimd::select(mask, v01, zero);
        v10 = xsimd::select(mask, v10, zero);
        v11 = xsimd::select(mask, v11, zero);
    }
};

/// The cells at voxels[index] and their neighbours in the next row.
template <class Arch, class Voxel>
Cell<typename Lanes<Arch>::Floats> load_cell(const Voxel* voxels, const typename Lanes<Arch>::Ints& index,
                                             std::ptrdiff_t row_stride) {
    Cell<typename Lanes<Arch>::Floats> cell;
    Pairs<Arch>::load(voxels, index, cell.v00, cell.v01);
    Pairs<Arch>::load(voxels + row_stride, index, cell.v10, cell.v11);
    return cell;
}

/// Sums of slopes over the planes of a slab, and of slopes times the plane's number in it.
template <class Floats>
struct SlopeSums {
    Floats row = Floats(0.F), column = Floats(0.F), row_moment = Floats(0.F), column_moment = Floats(0.F);

    void add(const Floats& row_slope, const Floats& column_slope, const Floats& step) {
        row += row_slope;
        column += column_slope;
        row_moment = fused(step, row_slope, row_moment);
        column_moment = fused(step, column_slope, column_moment);
    }

    /// Adds to the packet, whose moments count from the source: `distance` planes before the slab's first.
    template <class Packet>
    void store(Packet& packet, const Floats& distance) const {
        const auto add_to = [](float* sum, const Floats& value) {
            (Floats::load_aligned(sum) + value).store_aligned(sum);
        };
        add_to(packet.row_gradient, row);
        add_to(packet.column_gradient, column);
        add_to(packet.row_moment, fused(distance, row, row_moment));
        add_to(packet.column_moment, fused(distance, column, column_moment));
    }
};

template <class Packet>
void clear_slopes(Packet& packet) {
    for (int i = 0; i < Packet::count; ++i) {
        packet.row_gradient[i] = packet.column_gradient[i] = packet.row_moment[i] = packet.column_moment[i] = 0;
    }
}

/// dI / dp for the six parameters and the rays of a packet. With plane distance d from the source, a sample's row is
/// s_r + d m_r, m_r = ray_r / ray_a (columns alike), and the length per plane L ~ 1 / |ray_a|; so
///   dI = L sum_k [ f_r (ds_r - m_r ds_a + d dm_r) + f_c (...) ] - I dray_a / ray_a,
///   dm_r = (dray_r - m_r dray_a) / ray_a.
/// Derived from core/CONVENTIONS.md section 5. It is linear in ds and dray: what they are multiplied by is the same for
/// all parameters.
template <class Packet>
void store_derivatives(const CastJob& job, int axis, const Packet& packet) {
    using Arch = typename Packet::Arch;
    using Floats = typename Lanes<Arch>::Floats;
    constexpr int count = Packet::count, width = Lanes<Arch>::width;
    const int row = kAxisOrder[axis][1], column = kAxisOrder[axis][2];
    const auto number = [](double value) { return Floats(static_cast<float>(value)); };
    alignas(64) float pixels[2][count], image[count];
    for (int i = 0; i < count; ++i) {
        const int x = packet.x + i % width, y = packet.y + i / width;
        pixels[0][i] = static_cast<float>(x);
        pixels[1][i] = static_cast<float>(y);
    }
    const Floats u = Floats::load_aligned(pixels[0]), v = Floats::load_aligned(pixels[1]);
    const Floats ray =
        fused(v, number(job.step_v[axis]), fused(u, number(job.step_u[axis]), number(job.direction[axis])));
    const Floats scale = Floats::load_aligned(packet.mm_per_plane) * Floats(job.layouts[axis].unit_per_mm),
                 per_ray = scale / ray;
    const Floats m_r = Floats::load_aligned(packet.row_slope), m_c = Floats::load_aligned(packet.column_slope);
    const auto times = [](const float* sum, const Floats& factor) { return Floats::load_aligned(sum) * factor; };
    // By ds and by dray, along rows, columns and the axis.
    Floats source[3], ray_by[3];
    source[row] = times(packet.row_gradient, scale);
    source[column] = times(packet.column_gradient, scale);
    source[axis] = -fused(m_r, source[row], m_c * source[column]);
    ray_by[row] = times(packet.row_moment, per_ray);
    ray_by[column] = times(packet.column_moment, per_ray);
    ray_by[axis] = -fused(m_r, ray_by[row], fused(m_c, ray_by[column], times(packet.sum, per_ray)));
    const FrameDerivatives& d = *job.derivatives;
    for (int p = 0; p < kParameters; ++p) {
        Floats sum(0.F);
        for (int i = 0; i < 3; ++i) {
            const Floats change =
                fused(v, Floats(d.step_v[p][i]), fused(u, Floats(d.step_u[p][i]), Floats(d.direction[p][i])));
            sum = fused(source[i], Floats(d.source[p][i]), fused(ray_by[i], change, sum));
        }
        sum.store_aligned(image);
        store_pixels(packet, image, job.image + (1 + p) * job.image_distance, job.image_stride);
    }
}

}  // namespace
}  // namespace raylign::detail::cpu
