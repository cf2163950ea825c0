#pragma once

#include "backends/cpu/joseph_packet.h"

namespace raylign::cpu {
namespace {

/// Slopes that bound all lanes of a tile.
template <class Packet>
struct TileBounds {
    double row_low = 1e300, row_high = -1e300, column_low = 1e300, column_high = -1e300;

    TileBounds(const Packet* packets, int count) {
        for (const Packet* packet = packets; packet != packets + count; ++packet) {
            row_low = minimum(row_low, packet->row_line - packet->row_spread);
            row_high = maximum(row_high, packet->row_line + packet->row_spread);
            column_low = minimum(column_low, packet->column_line - packet->column_spread);
            column_high = maximum(column_high, packet->column_line + packet->column_spread);
        }
    }
};

/// A slab of planes and the rows and columns that a tile (its packets' lines) can meet there, and on `margin` planes
/// (0 or 1) before and after it.
template <class Packet>
struct TileSlab {
    SlabPart part{};
    Range rows{}, columns{};
    bool occupied = false;  ///< within that reach, this slab or, with a margin, the one before

    TileSlab(const CastJob& job, int axis, const TileBounds<Packet>& bounds, int slab, int margin) {
        const PlaneLayout& layout = job.layouts[axis];
        part.begin = slab * kSlabPlanes;
        part.end = part.begin + kSlabPlanes < layout.planes ? part.begin + kSlabPlanes : layout.planes;
        if (part.begin - margin >= part.end) return;
        part.d0 = part.begin - margin - job.source[axis];
        part.d1 = part.end - 1 + margin - job.source[axis];
        rows = reach(job.source[kAxisOrder[axis][1]], bounds.row_low, bounds.row_high);
        columns = reach(job.source[kAxisOrder[axis][2]], bounds.column_low, bounds.column_high);
        occupied =
            is_occupied(layout, slab, rows, columns) || (margin > 0 && is_occupied(layout, slab - 1, rows, columns));
    }

    [[nodiscard]] Range reach(double source, double low, double high) const {
        const double a = part.d0 * low, b = part.d0 * high, c = part.d1 * low, d = part.d1 * high;
        return {source + minimum(minimum(a, b), minimum(c, d)) - kSlack,
                source + maximum(maximum(a, b), maximum(c, d)) + kSlack};
    }
};

/// Brings the next slab's voxels of a tile into the L2 cache while the packets pass the present slab, each its share:
/// rays jump from row to row and plane to plane, which no hardware prefetcher follows. 20 ms without it are 11 with it
/// (256^3, 256^2, one Zen 4 core).
template <class Voxel>
struct Prefetch {
    static constexpr int kLine = 64 / sizeof(Voxel);
    const Voxel* plane = nullptr;
    std::ptrdiff_t plane_stride, row_stride;
    int rows = 0, columns = 0, row = 0, left = 0, share = 0;

    template <class Slab>
    Prefetch(const PlaneLayout& layout, const Slab& next, int packets)
        : plane_stride(layout.plane_stride), row_stride(layout.row_stride) {
        if (!next.occupied || next.part.begin >= layout.end[0]) return;
        const int row0 = floor_clamped(next.rows.low, layout.begin[1], layout.end[1]);
        const int column0 = floor_clamped(next.columns.low, layout.begin[2], layout.end[2]);
        rows = floor_clamped(next.rows.high + 2, layout.begin[1], layout.end[1]) - row0;
        columns = floor_clamped(next.columns.high + 2, layout.begin[2], layout.end[2]) - column0 + kLine - 1;
        plane = voxel_at<Voxel>(layout, next.part.begin, row0, column0);
        left = (next.part.end - next.part.begin) * rows;
        share = (left + packets - 1) / packets;
    }

    void some() {
        for (int i = 0; i < share && left > 0; ++i, --left) {
            const Voxel* line = plane + row * row_stride;
            for (int column = 0; column < columns; column += kLine) __builtin_prefetch(line + column, 0, 2);
            if (++row < rows) continue;
            row = 0;
            plane += plane_stride;
        }
    }
    void all() {
        while (left > 0) some();
    }
};

}  // namespace
}  // namespace raylign::cpu
