#pragma once

#include "backends/cpu/lanes.h"

namespace raylign::detail::cpu {
namespace {

/// Filter and sums of one band of rows: gradients as core/image/gradient_filter.h, both directions from one pass over
/// the rows and one over the columns, summed at once and never stored.
template <class Arch>
struct Band {
    using Floats = typename Lanes<Arch>::Floats;
    static constexpr std::ptrdiff_t kLanes = Lanes<Arch>::count;

    /// Sums of 16 columns side by side in double, added up in order at the end: the same order for every instruction
    /// set.
    struct Sums {
        FourDoubles moving[4] = {}, moving_moving[4] = {}, fixed_moving[4] = {};

        void add(const float* moving_row, const float* fixed_row, const float* weight_row) {
            for (std::ptrdiff_t i = 0; i < 4; ++i) {
                FourDoubles b, a, weight;
                load_four(moving_row + 4 * i, b);
                load_four(fixed_row + 4 * i, a);
                load_four(weight_row + 4 * i, weight);
                const FourDoubles wb = weight * b;
                moving[i] += wb;
                moving_moving[i] += wb * b;
                fixed_moving[i] += wb * a;
            }
        }
        BandSums total() const { return {total_of(moving), total_of(moving_moving), total_of(fixed_moving)}; }
    };

    static void sum(const BandJob& job, BandSums* sums) noexcept {
        if (job.channels == 1) {
            Sums channel;
            for (int y = job.y0; y < job.y1; ++y) {
                for (std::ptrdiff_t x = y * job.stride; x < y * job.stride + job.width; x += 16) {
                    channel.add(job.image + x, job.fixed[0] + x, job.weights + x);
                }
            }
            sums[0] = channel.total();
            return;
        }
        filter_rows(job);
        sum_columns(job, sums);
    }

    static int first_row(const BandJob& job) { return job.y0 > job.radius ? job.y0 - job.radius : 0; }

    /// Filtered rows lie an odd number of cache lines apart, so that a column does not fall into few sets of the cache.
    static std::ptrdiff_t filtered_stride(const BandJob& job) { return job.stride | 16; }

    static float* row_filtered(const BandJob& job, int direction, int y) {
        const std::ptrdiff_t rows = kBandRows + 2 * job.radius;
        return job.scratch + job.stride + 2 * std::ptrdiff_t{job.radius} + 16 +
               (direction * rows + y - first_row(job)) * filtered_stride(job);
    }

    /// Several vectors of a row at once: as many sums side by side keep the adders busy, and share taps and addresses.
    static constexpr std::ptrdiff_t kBlock = 4;

    /// Calls pass.block<blocks>(x) for columns [begin, end), most of them kBlock vectors at a time.
    template <class Pass>
    static void along_row(std::ptrdiff_t begin, std::ptrdiff_t end, const Pass& pass) {
        for (; begin + kBlock * kLanes <= end; begin += kBlock * kLanes) pass.template block<kBlock>(begin);
        for (; begin < end; begin += kLanes) pass.template block<1>(begin);
    }

    /// Derivative (0) and smoothing (1) along the rows that the band's columns will need.
    static void filter_rows(const BandJob& job) {
        const int last = job.y1 + job.radius < job.height ? job.y1 + job.radius : job.height;
        float* padded = job.scratch;
        for (int y = first_row(job); y < last; ++y) {
            const float* in = job.image + y * job.stride;
            for (int x = 0; x < job.radius; ++x) padded[x] = in[0];
            for (int x = 0; x < job.width; ++x) padded[job.radius + x] = in[x];
            for (std::ptrdiff_t x = job.width; x < job.stride + job.radius; ++x)
                padded[job.radius + x] = in[job.width - 1];
            along_row(0, job.stride,
                      RowPass{job, padded + job.radius, row_filtered(job, 0, y), row_filtered(job, 1, y)});
        }
    }

    struct RowPass {
        const BandJob& job;
        const float* in;
        float *derivative, *smooth;

        template <std::ptrdiff_t blocks>
        void block(std::ptrdiff_t x) const {
            Floats d[blocks], s[blocks];
            for (std::ptrdiff_t b = 0; b < blocks; ++b) {
                d[b] = Floats(0.F);
                s[b] = Floats(job.smooth[0]) * Floats::load_unaligned(in + x + b * kLanes);
            }
            for (int k = 1; k <= job.radius; ++k) {
                const Floats derivative_tap(job.derivative[k]), smooth_tap(job.smooth[k]);
                for (std::ptrdiff_t b = 0; b < blocks; ++b) {
                    const float* centre = in + x + b * kLanes;
                    const Floats after = Floats::load_unaligned(centre + k),
                                 before = Floats::load_unaligned(centre - k);
                    d[b] = fused(derivative_tap, after - before, d[b]);
                    s[b] = fused(smooth_tap, after + before, s[b]);
                }
            }
            for (std::ptrdiff_t b = 0; b < blocks; ++b) {
                d[b].store_unaligned(derivative + x + b * kLanes);
                s[b].store_unaligned(smooth + x + b * kLanes);
            }
        }
    };

    /// Gradients of columns from `first` on of row y, at most kBandColumns, from the filtered rows around it.
    struct ColumnPass {
        const BandJob& job;
        int y;
        std::ptrdiff_t first;
        float *gx, *gy;

        template <std::ptrdiff_t blocks>
        void block(std::ptrdiff_t x) const {
            Floats smooth_of_derivative[blocks], derivative_of_smooth[blocks];
            const float* centre = row_filtered(job, 0, y) + x;
            for (std::ptrdiff_t b = 0; b < blocks; ++b) {
                smooth_of_derivative[b] = Floats(job.smooth[0]) * Floats::load_unaligned(centre + b * kLanes);
                derivative_of_smooth[b] = Floats(0.F);
            }
            const std::ptrdiff_t to_smooth = row_filtered(job, 1, y) - row_filtered(job, 0, y);
            for (int k = 1; k <= job.radius; ++k) {
                const float* before = centre - (y > k ? k : y) * filtered_stride(job);
                const float* after = centre + (y + k < job.height ? k : job.height - 1 - y) * filtered_stride(job);
                const Floats derivative_tap(job.derivative[k]), smooth_tap(job.smooth[k]);
                for (std::ptrdiff_t b = 0; b < blocks; ++b, before += kLanes, after += kLanes) {
                    const Floats d = Floats::load_unaligned(after) + Floats::load_unaligned(before);
                    const Floats s =
                        Floats::load_unaligned(after + to_smooth) - Floats::load_unaligned(before + to_smooth);
                    smooth_of_derivative[b] = fused(smooth_tap, d, smooth_of_derivative[b]);
                    derivative_of_smooth[b] = fused(derivative_tap, s, derivative_of_smooth[b]);
                }
            }
            for (std::ptrdiff_t b = 0; b < blocks; ++b) {
                smooth_of_derivative[b].store_unaligned(gx + x - first + b * kLanes);
                derivative_of_smooth[b].store_unaligned(gy + x - first + b * kLanes);
            }
        }
    };

    static void sum_columns(const BandJob& job, BandSums* sums) {
        Sums along_x, along_y;
        alignas(64) float gx[kBandColumns], gy[kBandColumns];
        for (std::ptrdiff_t first = 0; first < job.stride; first += kBandColumns) {
            const std::ptrdiff_t end = first + kBandColumns < job.stride ? first + kBandColumns : job.stride;
            for (int y = job.y0; y < job.y1; ++y) {
                along_row(first, end, ColumnPass{job, y, first, gx, gy});
                for (std::ptrdiff_t x = first; x < end; x += 16) {
                    const std::ptrdiff_t at = y * job.stride + x;
                    along_x.add(gx + x - first, job.fixed[0] + at, job.weights + at);
                    along_y.add(gy + x - first, job.fixed[1] + at, job.weights + at);
                }
            }
        }
        sums[0] = along_x.total();
        sums[1] = along_y.total();
    }
};

}  // namespace
}  // namespace raylign::detail::cpu
