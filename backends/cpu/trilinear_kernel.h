#pragma once

#include "backends/cpu/joseph_derivatives.h"
#include "backends/cpu/joseph_tile.h"
#include "backends/cpu/trilinear_packet.h"

namespace raylign::detail::cpu {
namespace {

/// The midpoint rule for one tile: samples at (k + 1/2) step from the source, with their slopes where derivatives are
/// asked for. Samples outside the support are zero, so a packet may take more of them than a ray needs without changing
/// its sum.
template <class Arch, class Voxel, Order order>
struct Trilinear {
    using L = Lanes<Arch>;
    using Floats = typename L::Floats;
    using Ints = typename L::Ints;
    using Packet = TrilinearPacket<Arch>;
    using ByPlanes = TrilinearFootprint<Arch>;

    static void cast(const CastJob& job) noexcept {
        Packet* packets = static_cast<Packet*>(job.scratch);
        const int axis = ByPlanes::available ? axis_of(job) : 2;
        int by_planes = 0;
        const int count = collect(job, axis, packets, by_planes);
        if (by_planes > 0) march_planes(job, axis, packets, by_planes);
        march_samples(job.layouts[axis], packets + by_planes, count - by_planes);
        for (int i = 0; i < count; ++i) {
            store(job, axis, packets[i]);
            if constexpr (order == Order::derivatives) store_trilinear_derivatives(job, axis, packets[i]);
        }
    }

private:
    /// The dominant axis of the tile's middle pixel: all rays of the tile are about as long along it.
    static int axis_of(const CastJob& job) {
        const PacketRays<1, 1> ray(job, (job.x0 + job.x1) / 2, (job.y0 + job.y1) / 2);
        for (int axis = 0; axis < 2; ++axis) {
            if (ray.lanes_along(axis, job.axis_ratio)) return axis;
        }
        return 2;
    }

    /// Returns the number of packets; those to be taken plane by plane come first.
    static int collect(const CastJob& job, int axis, Packet* packets, int& by_planes) {
        const double source[3] = {job.source[kAxisOrder[axis][0]], job.source[kAxisOrder[axis][1]],
                                  job.source[kAxisOrder[axis][2]]};
        int count = 0;
        for (int y = job.y0; y < job.y1; y += L::height) {
            for (int x = job.x0; x < job.x1; x += L::width) {
                if (!is_needed(job, x, y)) continue;
                const PacketRays<L::count, L::width> rays(job, x, y);
                Packet& packet = packets[count];
                packet.x = x;
                packet.y = y;
                packet.lanes = rays.inside;
                set_samples(job, axis, rays, packet);
                const int parts = ByPlanes::split(job.layouts[axis], source, &packet);
                count += parts > 0 ? parts : 1;
                for (int i = count - parts; i < count; ++i, ++by_planes) {
                    if (by_planes == i) continue;
                    const Packet other = packets[by_planes];
                    packets[by_planes] = packets[i];
                    packets[i] = other;
                }
            }
        }
        return count;
    }

    /// Plane by plane, slab by slab as in Joseph: slab s holds the samples between planes 16 s - 1 and 16 s + 15.
    static void march_planes(const CastJob& job, int axis, Packet* packets, int count) {
        const PlaneLayout& layout = job.layouts[axis];
        const double plane_source = job.source[kAxisOrder[axis][0]], row_source = job.source[kAxisOrder[axis][1]],
                     column_source = job.source[kAxisOrder[axis][2]];
        const TileBounds<Packet> bounds(packets, count);
        const TileShape shape(job, axis);
        const int first = layout.begin[0] / kSlabPlanes, last = (layout.end[0] + kSlabPlanes - 1) / kSlabPlanes;
        TileSlab<Packet> next(job, axis, bounds, first, 1);
        for (int slab = first; slab <= last; ++slab) {
            const TileSlab<Packet> tile = next;
            next = TileSlab<Packet>(job, axis, bounds, slab + 1, 1);
            Prefetch<Voxel> prefetch(job, axis, shape, next, count);
            if (!tile.occupied) {
                prefetch.all();
                continue;
            }
            SlabPart part{};
            part.begin = slab * kSlabPlanes - 1;
            part.end = part.begin + kSlabPlanes < layout.planes ? part.begin + kSlabPlanes : layout.planes;
            part.d0 = part.begin - plane_source;
            part.d1 = part.end - plane_source;
            ReadAhead ahead;
            for (Packet* packet = packets; packet != packets + count; ++packet) {
                prefetch.some(ahead);
                ahead.at_once();
                const Range rows = line_range(row_source, packet->row_line, packet->row_spread, part.d0, part.d1);
                const Range columns =
                    line_range(column_source, packet->column_line, packet->column_spread, part.d0, part.d1);
                if (!is_occupied(layout, slab, rows, columns) && !is_occupied(layout, slab - 1, rows, columns))
                    continue;
                part.row = row_source + part.d0 * packet->row_line;
                part.column = column_source + part.d0 * packet->column_line;
                part.row0 = floor_clamped(rows.low - 1, -1, layout.rows);
                part.column0 = floor_clamped(columns.low - 1, -1, layout.columns);
                ByPlanes::template march<Voxel, order>(layout, *packet, part);
            }
        }
    }

    /// The packets that are left, sample by sample: all rays of a packet take the same number at once.
    static void march_samples(const PlaneLayout& layout, Packet* packets, int count) {
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
    }

    static constexpr int kChunk = 32;  ///< samples that all packets of a tile take before the next ones

    /// The coordinates of a run of samples, as floats from a base voxel before all of them on.
    struct Run {
        alignas(64) float start[3][L::count], step[3][L::count], end[L::count];
        int base[3];
        double low[3], high[3];

        Run(const PlaneLayout& layout, const Packet& packet, double first, int samples) {
            const int sizes[3] = {layout.planes, layout.rows, layout.columns};
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = 1e300;
                high[axis] = -1e300;
                for (int i = 0; i < L::count; ++i) {
                    const double a = packet.start[axis][i] + first * packet.step[axis][i];
                    const double b = a + (samples - 1) * packet.step[axis][i];
                    low[axis] = minimum(low[axis], minimum(a, b));
                    high[axis] = maximum(high[axis], maximum(a, b));
                }
                base[axis] = floor_clamped(low[axis] - 1, -1, sizes[axis]);
                for (int i = 0; i < L::count; ++i) {
                    start[axis][i] =
                        static_cast<float>(packet.start[axis][i] + first * packet.step[axis][i] - base[axis]);
                    step[axis][i] = static_cast<float>(packet.step[axis][i]);
                }
            }
            for (int i = 0; i < L::count; ++i) end[i] = static_cast<float>(packet.end[i] - first);
        }

        /// True if a block within reach of the run holds a non-zero voxel.
        [[nodiscard]] bool is_any_occupied(const PlaneLayout& layout) const {
            const Range rows{low[1] - kSlack, high[1] + kSlack}, columns{low[2] - kSlack, high[2] + kSlack};
            if (!(high[0] > -1 && low[0] < layout.planes)) return false;
            const int last = floor_clamped(high[0] + 1 + kSlack, 0, layout.planes - 1) / kSlabPlanes;
            for (int slab = floor_clamped(low[0] - kSlack, 0, layout.planes - 1) / kSlabPlanes; slab <= last; ++slab) {
                if (is_occupied(layout, slab, rows, columns)) return true;
            }
            return false;
        }
    };

    /// Adds `samples` samples from number `first` on to the sums of a packet.
    static void march_chunk(const PlaneLayout& layout, Packet& packet, double first, int samples) {
        const Run run(layout, packet, first, samples);
        if (!run.is_any_occupied(layout)) return;
        const Voxel* voxels = voxel_at<Voxel>(layout, run.base[0], run.base[1], run.base[2]);
        // Clamping to the voxels that are there and the zeros around them gives zeros beyond, and no other address.
        const Floats zero(0.F);
        Floats least[3], most[3];
        for (int axis = 0; axis < 3; ++axis) {
            least[axis] = xsimd::max(zero, Floats(static_cast<float>(layout.begin[axis] - 1 - run.base[axis])));
            most[axis] = Floats(static_cast<float>(layout.end[axis] - run.base[axis]));
        }
        Floats sum(0.F), gradient[3] = {zero, zero, zero}, moment[3] = {zero, zero, zero};
        for (int k = 0; k < samples; ++k) {
            const Floats at(static_cast<float>(k));
            Floats raw[3], x[3];
            for (int axis = 0; axis < 3; ++axis) {
                raw[axis] = fused(at, Floats::load_aligned(run.step[axis]), Floats::load_aligned(run.start[axis]));
                x[axis] = xsimd::min(xsimd::max(raw[axis], least[axis]), most[axis]);
            }
            Sample sample(layout, voxels, x);
            const auto counts = at < Floats::load_aligned(run.end);
            if (packet.limited) sample.value = xsimd::select(counts, sample.value, zero);
            sum += sample.value;
            if constexpr (order == Order::derivatives) {
                for (int axis = 0; axis < 3; ++axis) {
                    // At the lower border the value is 0 either way, but a slope would come from the voxels inside.
                    const Floats kept = xsimd::select(counts && raw[axis] >= least[axis], sample.slope[axis], zero);
                    gradient[axis] += kept;
                    moment[axis] = fused(at, kept, moment[axis]);
                }
            }
        }
        add_to(packet.sum, sum);
        if constexpr (order == Order::derivatives) {
            const Floats number(static_cast<float>(first + 0.5));
            for (int axis = 0; axis < 3; ++axis) {
                add_to(packet.gradient[axis], gradient[axis]);
                add_to(packet.moment[axis], fused(number, gradient[axis], moment[axis]));
            }
        }
    }

    static void add_to(float* total, const Floats& part) { (Floats::load_aligned(total) + part).store_aligned(total); }

    /// Value and slopes of the trilinear interpolant, from the cells in two planes.
    struct Sample {
        Floats value, slope[3];

        /// Coordinates are >= 0, or whole: truncation is floor.
        Sample(const PlaneLayout& layout, const Voxel* voxels, const Floats (&x)[3]) {
            const Ints plane = xsimd::to_int(x[0]), row = xsimd::to_int(x[1]), column = xsimd::to_int(x[2]);
            const Floats fp = x[0] - xsimd::to_float(plane), fr = x[1] - xsimd::to_float(row),
                         fc = x[2] - xsimd::to_float(column);
            const Ints index = plane * Ints(static_cast<std::int32_t>(layout.plane_stride)) +
                               row * Ints(static_cast<std::int32_t>(layout.row_stride)) + column;
            const Cell<Floats> a = load_cell<Arch>(voxels, index, layout.row_stride),
                               b = load_cell<Arch>(voxels + layout.plane_stride, index, layout.row_stride);
            const Floats va = a.value(fr, fc), rise = b.value(fr, fc) - va;
            value = fused(fp, rise, va);
            if constexpr (order == Order::derivatives) {
                const Floats along_row = a.row_slope(fc), along_column = a.column_slope(fr);
                slope[0] = rise;
                slope[1] = fused(fp, b.row_slope(fc) - along_row, along_row);
                slope[2] = fused(fp, b.column_slope(fr) - along_column, along_column);
            }
        }
    };

    static void store(const CastJob& job, int axis, const Packet& packet) {
        const float scale = static_cast<float>(job.step_mm) * job.layouts[axis].unit_per_mm;
        float image[L::count];
        for (int i = 0; i < L::count; ++i) image[i] = packet.sum[i] * scale;
        store_pixels(packet, image, job.image, job.image_stride);
    }
};

}  // namespace
}  // namespace raylign::detail::cpu
