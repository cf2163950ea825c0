#pragma once

#include "backends/cpu/lanes.h"

namespace raylign::cpu {
namespace {

/// Filter and sums of one band of rows: gradients as core/image/gradient_filter.h, both directions from one pass over
/// the rows and one over the columns, summed at once and never stored.
template <class Arch>
struct Band {
    using Floats = typename Lanes<Arch>::Floats;
    static constexpr int kLanes = Lanes<Arch>::count;

    /// Sums of 16 columns side by side in double, added up in order at the end: the same order for every instruction
    /// set.
    struct Sums {
        double moving[16] = {}, moving_moving[16] = {}, fixed_moving[16] = {};

        void add(const float* moving_row, const float* fixed_row, const float* weight_row) {
            for (int i = 0; i < 16; ++i) {
                const double b = moving_row[i], a = fixed_row[i], wb = weight_row[i] * b;
                moving[i] += wb;
                moving_moving[i] += wb * b;
                fixed_moving[i] += wb * a;
            }
        }
        BandSums total() const {
            BandSums sums = {0, 0, 0};
            for (int i = 0; i < 16; ++i) {
                sums.moving += moving[i];
                sums.moving_moving += moving_moving[i];
                sums.fixed_moving += fixed_moving[i];
            }
            return sums;
        }
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

    static float* row_filtered(const BandJob& job, int direction, int y) {
        const std::ptrdiff_t rows = kBandRows + 2 * job.radius;
        return job.scratch + job.stride + 2 * job.radius + 16 + (direction * rows + y - first_row(job)) * job.stride;
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
            float* derivative = row_filtered(job, 0, y);
            float* smooth = row_filtered(job, 1, y);
            for (std::ptrdiff_t x = 0; x < job.stride; x += kLanes) {
                const float* centre = padded + job.radius + x;
                Floats d(0.F), s = Floats(job.smooth[0]) * Floats::load_unaligned(centre);
                for (int k = 1; k <= job.radius; ++k) {
                    const Floats after = Floats::load_unaligned(centre + k),
                                 before = Floats::load_unaligned(centre - k);
                    d = xsimd::fma(Floats(job.derivative[k]), after - before, d);
                    s = xsimd::fma(Floats(job.smooth[k]), after + before, s);
                }
                d.store_unaligned(derivative + x);
                s.store_unaligned(smooth + x);
            }
        }
    }

    static void sum_columns(const BandJob& job, BandSums* sums) {
        Sums along_x, along_y;
        alignas(64) float gx[16], gy[16];
        for (int y = job.y0; y < job.y1; ++y) {
            for (std::ptrdiff_t x = 0; x < job.width; x += 16) {
                for (int i = 0; i < 16; i += kLanes) filter_column(job, x + i, y, gx + i, gy + i);
                const std::ptrdiff_t at = y * job.stride + x;
                along_x.add(gx, job.fixed[0] + at, job.weights + at);
                along_y.add(gy, job.fixed[1] + at, job.weights + at);
            }
        }
        sums[0] = along_x.total();
        sums[1] = along_y.total();
    }

    static void filter_column(const BandJob& job, std::ptrdiff_t x, int y, float* gx, float* gy) {
        Floats smooth_of_derivative = Floats(job.smooth[0]) * Floats::load_unaligned(row_filtered(job, 0, y) + x);
        Floats derivative_of_smooth(0.F);
        for (int k = 1; k <= job.radius; ++k) {
            const int before = y > k ? y - k : 0, after = y + k < job.height ? y + k : job.height - 1;
            const Floats d = Floats::load_unaligned(row_filtered(job, 0, after) + x) +
                             Floats::load_unaligned(row_filtered(job, 0, before) + x);
            const Floats s = Floats::load_unaligned(row_filtered(job, 1, after) + x) -
                             Floats::load_unaligned(row_filtered(job, 1, before) + x);
            smooth_of_derivative = xsimd::fma(Floats(job.smooth[k]), d, smooth_of_derivative);
            derivative_of_smooth = xsimd::fma(Floats(job.derivative[k]), s, derivative_of_smooth);
        }
        smooth_of_derivative.store_unaligned(gx);
        derivative_of_smooth.store_unaligned(gy);
    }
};

}  // namespace
}  // namespace raylign::cpu
