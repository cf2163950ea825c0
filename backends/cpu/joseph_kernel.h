#pragma once

#include "backends/cpu/joseph_derivatives.h"
#include "backends/cpu/joseph_tile.h"
#include "backends/cpu/pairs.h"

namespace raylign::detail::cpu {
namespace {

/// Joseph's method for one tile: packets of rays walk the planes of their dominant axis, slab by slab (see
/// reference_backend for the model). The slab of voxels that a tile needs stays in the cache while all of its packets
/// pass.
template <class Arch, class Voxel, Order order>
struct Joseph {
    using L = Lanes<Arch>;
    using Floats = typename L::Floats;
    using Ints = typename L::Ints;
    using Packet = JosephPacket<Arch>;
    using Rays = PacketRays<L::count, L::width>;
    /// Packets follow each other down strips of a tile: of the voxels that one reads, the L1 cache still has most when
    /// the next row of packets comes.
    static constexpr int kStripPx = 16;

    static void cast(const CastJob& job) noexcept {
        Packet* packets = static_cast<Packet*>(job.scratch);
        for (int axis = 0; axis < 3; ++axis) {
            const TileRays tile = look_at_tile(job, axis);
            if (!tile.some) continue;
            const int count = collect(job, axis, tile, packets);
            if (count == 0) continue;
            march(job, axis, packets, count);
            store(job, job.layouts[axis].unit_per_mm, packets, count);
            if constexpr (order == Order::derivatives) {
                for (int i = 0; i < count; ++i) store_derivatives(job, axis, packets[i]);
            }
        }
    }

private:
    /// What the corners of a tile tell of all its rays (directions are affine in the pixel), to spare most packets the
    /// checks.
    struct TileRays {
        bool some;       ///< a ray may have this dominant axis
        bool all;        ///< every ray has
        bool unlimited;  ///< all planes lie between source and detector, for every ray
    };
    static TileRays look_at_tile(const CastJob& job, int axis) {
        double low[3], high[3], signed_low = 0;  // of the absolute components
        for (int i = 0; i < 3; ++i) {
            double a = 0, b = 0;
            for (int corner = 0; corner < 4; ++corner) {
                const double u = corner & 1 ? job.x1 - 1 : job.x0, v = corner & 2 ? job.y1 - 1 : job.y0;
                const double r = job.direction[i] + u * job.step_u[i] + v * job.step_v[i];
                a = corner == 0 ? r : minimum(a, r);
                b = corner == 0 ? r : maximum(b, r);
            }
            high[i] = maximum(__builtin_fabs(a), __builtin_fabs(b));
            low[i] = a > 0 ? a : b < 0 ? -b : 0;
            if (i == axis) signed_low = a > 0 ? low[i] : -low[i];
        }
        const double ratio = job.axis_ratio * job.axis_ratio, reach = high[axis] * ratio;
        const int row = kAxisOrder[axis][1], column = kAxisOrder[axis][2];
        const double first = -job.source[axis], last = first + job.layouts[axis].planes - 1;
        const double near = signed_low > 0 ? first : -last, far = signed_low > 0 ? last : -first;  // along the rays
        return {!(low[row] > reach || low[column] > reach),
                low[axis] > high[row] * ratio && low[axis] > high[column] * ratio,
                near > 0 && far < job.depth_max_mm * low[axis] * (1 - 1e-9)};
    }

    static int collect(const CastJob& job, int axis, const TileRays& tile, Packet* packets) {
        int count = 0;
        for (int x0 = job.x0; x0 < job.x1; x0 += kStripPx) {
            const int x1 = x0 + kStripPx < job.x1 ? x0 + kStripPx : job.x1;
            for (int y = job.y0; y < job.y1; y += L::height) {
                for (int x = x0; x < x1; x += L::width) count += prepare(job, axis, tile, x, y, packets[count]);
            }
        }
        return count;
    }

    /// 1 where the packet has rays along the axis, else 0.
    static int prepare(const CastJob& job, int axis, const TileRays& tile, int x, int y, Packet& packet) {
        if (!is_needed(job, x, y)) return 0;
        Rays rays(job, x, y);
        const unsigned lanes = tile.all ? rays.inside : rays.lanes_along(axis, job.axis_ratio);
        if (lanes == 0) return 0;
        if (!tile.all) rays.fill_others(lanes);
        packet.x = x;
        packet.y = y;
        packet.lanes = lanes;
        packet.limited = false;
        if (!tile.unlimited) set_limits(job, axis, rays, packet);
        set_lines(job, axis, rays, packet);
        return 1;
    }

    static void set_lines(const CastJob& job, int axis, const Rays& rays, Packet& packet) {
        double rows[L::count], columns[L::count];
        const float plane_mm = static_cast<float>(job.spacing_mm[axis]);
        const float row_mm = static_cast<float>(job.spacing_mm[kAxisOrder[axis][1]]);
        const float column_mm = static_cast<float>(job.spacing_mm[kAxisOrder[axis][2]]);
        for (int i = 0; i < L::count; ++i) {
            const double per_plane = 1 / rays.ray[axis][i];
            rows[i] = rays.ray[kAxisOrder[axis][1]][i] * per_plane;
            columns[i] = rays.ray[kAxisOrder[axis][2]][i] * per_plane;
            const float across = static_cast<float>(rows[i]) * row_mm,
                        along = static_cast<float>(columns[i]) * column_mm;
            packet.mm_per_plane[i] = __builtin_sqrtf(plane_mm * plane_mm + across * across + along * along);
            packet.sum[i] = 0;
        }
        if constexpr (order == Order::derivatives) clear_slopes(packet);
        // The source's side, where not limited.
        const bool planes_follow = job.source[axis] < 0.5 * job.layouts[axis].planes;
        set_line(rows, planes_follow, packet.row_line, packet.row_spread, packet.row_offset, packet.row_slope);
        set_line(columns, planes_follow, packet.column_line, packet.column_spread, packet.column_offset,
                 packet.column_slope);
        packet.lines.set(packet, planes_follow);
    }

    static void set_line(const double (&slopes)[L::count], bool planes_follow, double& line, double& spread,
                         float* offset, float* slope) {
        // In four strands: one chain of comparisons would take as long as the rest of the packet's preparation.
        double lows[4] = {slopes[0], slopes[1], slopes[2], slopes[3]},
               highs[4] = {slopes[0], slopes[1], slopes[2], slopes[3]};
        for (int i = 4; i < L::count; i += 4) {
            for (int k = 0; k < 4; ++k) {
                lows[k] = minimum(lows[k], slopes[i + k]);
                highs[k] = maximum(highs[k], slopes[i + k]);
            }
        }
        const double low = minimum(minimum(lows[0], lows[1]), minimum(lows[2], lows[3]));
        const double high = maximum(maximum(highs[0], highs[1]), maximum(highs[2], highs[3]));
        line = planes_follow ? low : high;
        spread = high - low;
        for (int i = 0; i < L::count; ++i) {
            offset[i] = static_cast<float>(slopes[i] - line);
            slope[i] = static_cast<float>(slopes[i]);
        }
    }

    /// A plane counts if its depth (plane - source) / ray lies in (0, depth_max), exactly as in the reference. Source
    /// and detector are nearly always outside the volume: then nothing is limited.
    static void set_limits(const CastJob& job, int axis, const Rays& rays, Packet& packet) {
        const int last = job.layouts[axis].planes - 1;
        const double source = job.source[axis];
        for (int i = 0; i < L::count; ++i) {
            const double per_plane = 1 / rays.ray[axis][i];
            const auto counts = [&](int plane) {
                const double depth = (plane - source) * per_plane;
                return depth > 0 && depth < job.depth_max_mm;
            };
            packet.first_plane[i] = 0;
            packet.last_plane[i] = static_cast<float>(last);
            if (counts(0) && counts(last)) continue;
            packet.limited = true;
            // Depth is monotone in the plane, so the planes that count are an interval: guess its ends, settle them
            // exactly.
            const double end = source + job.depth_max_mm * rays.ray[axis][i];
            int a = floor_clamped(minimum(source, end) - 1, 0, last),
                b = floor_clamped(maximum(source, end) + 2, 0, last);
            while (a <= b && !counts(a)) ++a;
            while (b >= a && !counts(b)) --b;
            packet.first_plane[i] = static_cast<float>(a);
            packet.last_plane[i] = static_cast<float>(b);
        }
    }

    /// What a packet can meet. Where it is limited, lanes may lie on both sides of the source, and so of the line.
    static Range range(double source, double line, double spread, bool limited, const SlabPart& part) {
        const Range range = line_range(source, line, spread, part.d0, part.d1);
        const double reach = spread * maximum(__builtin_fabs(part.d0), __builtin_fabs(part.d1));
        return {range.low - (limited ? reach : 0), range.high};
    }

    static void march(const CastJob& job, int axis, Packet* packets, int count) {
        const PlaneLayout& layout = job.layouts[axis];
        const double row_source = job.source[kAxisOrder[axis][1]], column_source = job.source[kAxisOrder[axis][2]];
        const TileBounds<Packet> bounds(packets, count);
        const TileShape shape(job, axis);
        const int first = layout.begin[0] / kSlabPlanes;
        TileSlab<Packet> next(job, axis, bounds, first, 0);
        for (int slab = first; slab * kSlabPlanes < layout.end[0]; ++slab) {
            const TileSlab<Packet> tile = next;
            next = TileSlab<Packet>(job, axis, bounds, slab + 1, 0);
            Prefetch<Voxel> prefetch(job, axis, shape, next, count);
            if (!tile.occupied) {
                prefetch.all();
                continue;
            }
            SlabPart part = tile.part;
            ReadAhead ahead;
            for (Packet* packet = packets; packet != packets + count; ++packet) {
                prefetch.some(ahead);
                const Range rows = range(row_source, packet->row_line, packet->row_spread, packet->limited, part);
                const Range columns =
                    range(column_source, packet->column_line, packet->column_spread, packet->limited, part);
                if (!is_occupied(layout, slab, rows, columns)) continue;
                ahead.take();
                part.row = row_source + part.d0 * packet->row_line;
                part.column = column_source + part.d0 * packet->column_line;
                part.row0 = floor_clamped(rows.low - 1, -1, layout.rows);
                part.column0 = floor_clamped(columns.low - 1, -1, layout.columns);
                if (packet->limited || !Footprint<Arch>::template march<Voxel, order>(layout, *packet, part, ahead))
                    march_slab(layout, *packet, part, ahead);
            }
            ahead.at_once();
        }
    }

    /// Adds the bilinear values on the planes of a slab to the sums of a packet: a short float sum.
    static void march_slab(const PlaneLayout& layout, Packet& packet, const SlabPart& part, const ReadAhead& ahead) {
        const Floats distance(static_cast<float>(part.d0));
        const Floats row =
            fused(distance, Floats::load_aligned(packet.row_offset), Floats(static_cast<float>(part.row - part.row0)));
        const Floats column = fused(distance, Floats::load_aligned(packet.column_offset),
                                    Floats(static_cast<float>(part.column - part.column0)));
        const Floats row_slope = Floats::load_aligned(packet.row_slope),
                     column_slope = Floats::load_aligned(packet.column_slope);
        // Clamping to the voxels that are there and the zeros around them gives zeros beyond, and no other address.
        const auto from = [](int limit, int origin) { return Floats(static_cast<float>(limit - origin)); };
        const Floats zero(0.F), row_min = xsimd::max(zero, from(layout.begin[1] - 1, part.row0)),
                                row_max = from(layout.end[1], part.row0),
                                column_min = xsimd::max(zero, from(layout.begin[2] - 1, part.column0)),
                                column_max = from(layout.end[2], part.column0);
        const Ints row_stride(static_cast<std::int32_t>(layout.row_stride));
        const Voxel* voxels = voxel_at<Voxel>(layout, part.begin, part.row0, part.column0);
        Floats sum(0.F);
        SlopeSums<Floats> slopes;
        for (int plane = part.begin; plane < part.end; ++plane, voxels += layout.plane_stride) {
            ahead.on_plane(plane - part.begin);
            const Floats step(static_cast<float>(plane - part.begin));
            const Floats raw_r = fused(step, row_slope, row), raw_c = fused(step, column_slope, column);
            const Floats r = xsimd::min(xsimd::max(raw_r, row_min), row_max);
            const Floats c = xsimd::min(xsimd::max(raw_c, column_min), column_max);
            const Ints ri = xsimd::to_int(r), ci = xsimd::to_int(c);  // truncation is floor: >= 0, or the whole row_max
            Cell<Floats> cell = load_cell<Arch>(voxels, ri * row_stride + ci, layout.row_stride);
            const Floats fr = r - xsimd::to_float(ri), fc = c - xsimd::to_float(ci);
            if (packet.limited) {
                const Floats k(static_cast<float>(plane));
                cell.keep(k >= Floats::load_aligned(packet.first_plane) &&
                          k <= Floats::load_aligned(packet.last_plane));
            }
            sum += cell.value(fr, fc);
            if constexpr (order == Order::derivatives) {
                // At the lower border of the support the value is 0 either way, but a slope would come from the voxels
                // inside.
                slopes.add(xsimd::select(raw_r < row_min, zero, cell.row_slope(fc)),
                           xsimd::select(raw_c < column_min, zero, cell.column_slope(fr)), step);
            }
        }
        (Floats::load_aligned(packet.sum) + sum).store_aligned(packet.sum);
        if constexpr (order == Order::derivatives) slopes.store(packet, distance);
    }

    static void store(const CastJob& job, float unit_per_mm, const Packet* packets, int count) {
        for (const Packet* packet = packets; packet != packets + count; ++packet) {
            float image[L::count];
            for (int i = 0; i < L::count; ++i) image[i] = packet->sum[i] * (packet->mm_per_plane[i] * unit_per_mm);
            store_pixels(*packet, image, job.image, job.image_stride);
        }
    }
};

}  // namespace
}  // namespace raylign::detail::cpu
