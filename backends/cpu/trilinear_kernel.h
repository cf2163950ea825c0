#pragma once

#include "backends/cpu/pairs.h"

namespace raylign::cpu {
namespace {

/// The rays of a packet as sample positions.
template <class Arch>
struct alignas(64) TrilinearPacket {
    static constexpr int count = Lanes<Arch>::count;
    double start[3][count], step[3][count];  ///< voxel coordinates of sample k: start + k * step
    double end[count];                       ///< samples from this one on do not count, where limited
    float sum[count];
    double first, last;  ///< samples [first, last) meet the volume
    int x, y;
    unsigned lanes;
    bool limited;
};

/// The midpoint rule for one tile: samples at (k + 1/2) step from the source, on the layout of dominant axis 2. Samples
/// outside the support are zero, so a packet may take more of them than a ray needs without changing its sum.
template <class Arch, class Voxel>
struct Trilinear {
    using L = Lanes<Arch>;
    using Floats = typename L::Floats;
    using Ints = typename L::Ints;
    static constexpr int kChunk = 32;  ///< samples that all packets of a tile take before the next ones

    using Packet = TrilinearPacket<Arch>;

    static void cast(const CastJob& job) noexcept {
        Packet* packets = static_cast<Packet*>(job.scratch);
        const PlaneLayout& layout = job.layouts[2];
        const int count = collect(job, layout, packets);
        double first = 1e300, last = 0;
        for (const Packet* packet = packets; packet != packets + count; ++packet) {
            if (!(packet->first < packet->last)) continue;
            first = minimum(first, packet->first);
            last = maximum(last, packet->last);
        }
        // Samples are addressed by 32 bits from the first one of a chunk: beyond 2^31 voxels it must be a short one.
        const int chunk = layout.planes * layout.plane_stride > INT32_MAX ? 1 : kChunk;
        for (double begin = first; begin < last; begin += chunk) {
            for (Packet* packet = packets; packet != packets + count; ++packet) {
                const double a = maximum(begin, packet->first), b = minimum(begin + chunk, packet->last);
                if (a < b) march_chunk(layout, *packet, a, static_cast<int>(b - a));
            }
        }
        store(job, packets, count);
    }

    // Shared with trilinear_derivatives_kernel.h.
    static int collect(const CastJob& job, const PlaneLayout& layout, Packet* packets) {
        int count = 0;
        for (int y = job.y0; y < job.y1; y += L::height) {
            for (int x = job.x0; x < job.x1; x += L::width) {
                if (!is_needed(job, x, y)) continue;
                const PacketRays<L::count, L::width> rays(job, x, y);
                Packet& packet = packets[count++];
                packet.x = x;
                packet.y = y;
                packet.lanes = rays.inside;
                set_samples(job, layout, rays, packet);
            }
        }
        return count;
    }

    /// Depths at which a ray is inside the support (-1, n)^3, from the source on; empty if begin >= end.
    static void clip(const CastJob& job, const PlaneLayout& layout, const PacketRays<L::count, L::width>& rays,
                     int lane, double& begin, double& end) {
        const int sizes[3] = {layout.columns, layout.rows, layout.planes};
        begin = 0;
        end = __builtin_inf();
        for (int axis = 0; axis < 3; ++axis) {
            const double low = -1 - job.source[axis], high = sizes[axis] - job.source[axis], r = rays.ray[axis][lane];
            if (r == 0) {  // parallel: inside everywhere or nowhere
                if (!(low < 0 && high > 0)) end = 0;
                continue;
            }
            const double a = low / r, b = high / r;
            begin = maximum(begin, minimum(a, b));
            end = minimum(end, maximum(a, b));
        }
    }

    static void set_samples(const CastJob& job, const PlaneLayout& layout, const PacketRays<L::count, L::width>& rays,
                            Packet& packet) {
        packet.first = 1e300;
        packet.last = 0;
        packet.limited = false;
        for (int i = 0; i < L::count; ++i) {
            const double mx = job.spacing_mm[0] * rays.ray[0][i], my = job.spacing_mm[1] * rays.ray[1][i],
                         mz = job.spacing_mm[2] * rays.ray[2][i];
            const double depth_per_step = job.step_mm / __builtin_sqrt(mx * mx + my * my + mz * mz);
            for (int axis = 0; axis < 3; ++axis) {
                packet.step[axis][i] = depth_per_step * rays.ray[axis][i];
                packet.start[axis][i] = job.source[axis] + 0.5 * packet.step[axis][i];
            }
            packet.sum[i] = 0;
            packet.end[i] = __builtin_inf();
            double begin, end;
            clip(job, layout, rays, i, begin, end);
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

    /// The number of samples with (k + 1/2) depth_per_step < end, by the very comparison of the reference.
    static double sample_end(double end, double depth_per_step) {
        double k = maximum(0, __builtin_floor(end / depth_per_step - 0.5));
        while (k > 0 && !((k - 0.5) * depth_per_step < end)) --k;
        while ((k + 0.5) * depth_per_step < end) ++k;
        return k;
    }

    /// Adds `samples` samples from number `first` on to the sums of a packet.
    static void march_chunk(const PlaneLayout& layout, Packet& packet, double first, int samples) {
        const int sizes[3] = {layout.columns, layout.rows, layout.planes};
        alignas(64) float start[3][L::count], step[3][L::count], end[L::count];
        int base[3];
        double low[3], high[3];
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = 1e300;
            high[axis] = -1e300;
            for (int i = 0; i < L::count; ++i) {
                const double a = packet.start[axis][i] + first * packet.step[axis][i];
                const double b = a + (samples - 1) * packet.step[axis][i];
                low[axis] = minimum(low[axis], minimum(a, b));
                high[axis] = maximum(high[axis], maximum(a, b));
            }
        }
        if (!is_any_occupied(layout, low, high)) return;
        for (int axis = 0; axis < 3; ++axis) {
            base[axis] = floor_clamped(low[axis] - 1, -1, sizes[axis]);
            for (int i = 0; i < L::count; ++i) {
                start[axis][i] = static_cast<float>(packet.start[axis][i] + first * packet.step[axis][i] - base[axis]);
                step[axis][i] = static_cast<float>(packet.step[axis][i]);
            }
        }
        for (int i = 0; i < L::count; ++i) end[i] = static_cast<float>(packet.end[i] - first);
        const Floats zero(0.F), x_max(static_cast<float>(sizes[0] - base[0])),
            y_max(static_cast<float>(sizes[1] - base[1])), z_max(static_cast<float>(sizes[2] - base[2]));
        const Floats x0 = Floats::load_aligned(start[0]), y0 = Floats::load_aligned(start[1]),
                     z0 = Floats::load_aligned(start[2]);
        const Floats dx = Floats::load_aligned(step[0]), dy = Floats::load_aligned(step[1]),
                     dz = Floats::load_aligned(step[2]);
        const Voxel* voxels = static_cast<const Voxel*>(layout.origin) + base[2] * layout.plane_stride +
                              base[1] * layout.row_stride + base[0];
        Floats sum(0.F);
        for (int k = 0; k < samples; ++k) {
            const Floats at(static_cast<float>(k));
            const Floats x = xsimd::min(xsimd::max(xsimd::fma(at, dx, x0), zero), x_max);
            const Floats y = xsimd::min(xsimd::max(xsimd::fma(at, dy, y0), zero), y_max);
            const Floats z = xsimd::min(xsimd::max(xsimd::fma(at, dz, z0), zero), z_max);
            Floats value = interpolate(layout, voxels, x, y, z);
            if (packet.limited) value = xsimd::select(at < Floats::load_aligned(end), value, zero);
            sum += value;
        }
        (Floats::load_aligned(packet.sum) + sum).store_aligned(packet.sum);
    }

    /// True if a block within reach of the box [low, high] holds a non-zero voxel; 1e-3 of a voxel covers rounding.
    static bool is_any_occupied(const PlaneLayout& layout, const double (&low)[3], const double (&high)[3]) {
        if (!(high[2] > -1 && low[2] < layout.planes)) return false;
        const int last = floor_clamped(high[2] + 1 + 1e-3, 0, layout.planes - 1) / kSlabPlanes;
        for (int slab = floor_clamped(low[2] - 1e-3, 0, layout.planes - 1) / kSlabPlanes; slab <= last; ++slab) {
            if (is_occupied(layout, slab, low[1] - 1e-3, high[1] + 1e-3, low[0] - 1e-3, high[0] + 1e-3)) return true;
        }
        return false;
    }

    /// Trilinear values; coordinates are >= 0, so that truncation is floor.
    static Floats interpolate(const PlaneLayout& layout, const Voxel* voxels, const Floats& x, const Floats& y,
                              const Floats& z) {
        const Ints xi = xsimd::to_int(x), yi = xsimd::to_int(y), zi = xsimd::to_int(z);
        const Floats fx = x - xsimd::to_float(xi), fy = y - xsimd::to_float(yi), fz = z - xsimd::to_float(zi);
        const Ints index = zi * Ints(static_cast<std::int32_t>(layout.plane_stride)) +
                           yi * Ints(static_cast<std::int32_t>(layout.row_stride)) + xi;
        Floats planes[2];
        for (int plane = 0; plane < 2; ++plane, voxels += layout.plane_stride) {
            Floats v00, v01, v10, v11;
            Pairs<Arch>::load(voxels, index, v00, v01);
            Pairs<Arch>::load(voxels + layout.row_stride, index, v10, v11);
            const Floats v0 = xsimd::fma(fx, v01 - v00, v00), v1 = xsimd::fma(fx, v11 - v10, v10);
            planes[plane] = xsimd::fma(fy, v1 - v0, v0);
        }
        return xsimd::fma(fz, planes[1] - planes[0], planes[0]);
    }

    static void store(const CastJob& job, const Packet* packets, int count) {
        for (const Packet* packet = packets; packet != packets + count; ++packet) {
            for (int i = 0; i < L::count; ++i) {
                if (!(packet->lanes >> i & 1)) continue;
                job.image[(packet->y + i / L::width) * job.image_stride + packet->x + i % L::width] =
                    packet->sum[i] * (static_cast<float>(job.step_mm) * job.layouts[2].unit_per_mm);
            }
        }
    }
};

}  // namespace
}  // namespace raylign::cpu
