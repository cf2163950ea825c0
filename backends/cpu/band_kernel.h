#pragma once

#include "backends/cpu/lanes.h"

namespace raylign::detail::cpu {
namespace {

/// Filter and sums of one band of an image: gradients as core/image/gradient_filter.h, both directions from one pass
/// over the rows and one over the columns, summed at once and never stored. It goes down the band by stretches of rows,
/// and leaves out those of which nothing counts.
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
        Sums channels[2];
        if (job.channels == 1) {
            for (int y = job.y0; y < job.y1; ++y) {
                for (std::ptrdiff_t x = y * job.stride + job.x0; x < y * job.stride + job.x1; x += 16) {
                    channels[0].add(job.image + x, job.fixed[0] + x, job.weights + x);
                }
            }
            sums[0] = channels[0].total();
            return;
        }
        FilteredRows rows;
        for (int y = job.y0; y < job.y1; y += kStretchRows) {
            const Stretch stretch(job, y);
            if (!has_weight(job, stretch) || is_zero(job, stretch)) continue;
            rows.filter(job, stretch);
            sum_columns(job, stretch, channels);
        }
        for (int channel = 0; channel < 2; ++channel) sums[channel] = channels[channel].total();
    }

    /// Rows [begin, end) of a band, and those around them that their columns are filtered from.
    struct Stretch {
        int begin, end, first, last;

        Stretch(const BandJob& job, int y)
            : begin(y),
              end(y + kStretchRows < job.y1 ? y + kStretchRows : job.y1),
              first(begin > job.radius ? begin - job.radius : 0),
              last(end + job.radius < job.height ? end + job.radius : job.height) {}
    };

    static bool has_weight(const BandJob& job, const Stretch& stretch) {
        return has_any(job.weights, job.stride, job.x0, job.x1, stretch.begin, stretch.end);
    }
    /// True where all that the stretch is filtered from is zero: so are its gradients.
    static bool is_zero(const BandJob& job, const Stretch& stretch) {
        const int begin = job.x0 > job.radius ? job.x0 - job.radius : 0,
                  end = job.x1 + job.radius < job.width ? job.x1 + job.radius : job.width;
        return !has_any(job.image, job.stride, begin, end, stretch.first, stretch.last);
    }
    static bool has_any(const float* image, std::ptrdiff_t stride, int x0, int x1, int y0, int y1) {
        for (int y = y0; y < y1; ++y) {
            const float* row = image + y * stride;
            std::uint32_t bits = 0;
            for (int x = x0; x < x1; ++x) bits |= __builtin_bit_cast(std::uint32_t, row[x]);
            if (bits != 0) return true;
        }
        return false;
    }

    /// Derivative (0) or smoothing (1) along row y, of the band's columns.
    static float* row_filtered(const BandJob& job, const Stretch& stretch, int direction, int y) {
        return job.scratch + padded_floats(job) + std::ptrdiff_t{kBandColumns} * (2 * (y - stretch.first) + direction);
    }
    static std::ptrdiff_t padded_floats(const BandJob& job) {
        return kBandColumns + (2 * std::ptrdiff_t{job.radius} + 15) / 16 * 16;
    }

    /// Several vectors of a row at once: as many sums side by side keep the adders busy, and share taps and addresses.
    static constexpr std::ptrdiff_t kBlock = 4;

    /// Calls pass.block<blocks>(x) for columns [0, count), most of them kBlock vectors at a time.
    template <class Pass>
    static void along_row(std::ptrdiff_t count, const Pass& pass) {
        std::ptrdiff_t x = 0;
        for (; x + kBlock * kLanes <= count; x += kBlock * kLanes) pass.template block<kBlock>(x);
        for (; x < count; x += kLanes) pass.template block<1>(x);
    }

    /// What is filtered along the rows, in a job's scratch.
    struct FilteredRows {
        int first = 0, last = 0;  ///< rows that are there

        /// Adds what the stretch needs; of the one before it keeps what both do.
        void filter(const BandJob& job, const Stretch& stretch) {
            const int kept = last > stretch.first ? last - stretch.first : 0;
            if (kept > 0 && first != stretch.first) {
                float* const rows = row_filtered(job, stretch, 0, stretch.first);
                __builtin_memmove(rows, rows + std::ptrdiff_t{2} * kBandColumns * (stretch.first - first),
                                  sizeof(float) * 2 * kBandColumns * kept);
            }
            for (int y = stretch.first + kept; y < stretch.last; ++y) {
                along_row(job.x1 - job.x0, RowPass{job, row_of(job, y), row_filtered(job, stretch, 0, y),
                                                   row_filtered(job, stretch, 1, y)});
            }
            first = stretch.first;
            last = stretch.last;
        }

    private:
        /// The band's columns of a row, and `radius` more on both sides: copied where they reach beyond the image,
        /// whose last pixels repeat there.
        static const float* row_of(const BandJob& job, int y) {
            const float* in = job.image + y * job.stride;
            if (job.x0 >= job.radius && job.x1 + job.radius <= job.width) return in + job.x0;
            float* const padded = job.scratch + job.radius;
            const std::ptrdiff_t begin = -std::ptrdiff_t{job.radius}, end = job.x1 - job.x0 + job.radius;
            const std::ptrdiff_t left = job.x0 < job.radius ? -job.x0 : begin,
                                 right = job.width - job.x0 < end ? job.width - job.x0 : end;
            for (std::ptrdiff_t x = begin; x < left; ++x) padded[x] = in[0];
            __builtin_memcpy(padded + left, in + job.x0 + left, sizeof(float) * static_cast<std::size_t>(right - left));
            for (std::ptrdiff_t x = right; x < end; ++x) padded[x] = in[job.width - 1];
            return padded;
        }
    };

    /// Derivative and smoothing along a row.
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

    /// Gradients of the band's columns of row y, from the filtered rows around it.
    struct ColumnPass {
        const BandJob& job;
        const Stretch& stretch;
        int y;
        float *gx, *gy;

        template <std::ptrdiff_t blocks>
        void block(std::ptrdiff_t x) const {
            Floats smooth_of_derivative[blocks], derivative_of_smooth[blocks];
            const float* centre = row_filtered(job, stretch, 0, y) + x;
            for (std::ptrdiff_t b = 0; b < blocks; ++b) {
                smooth_of_derivative[b] = Floats(job.smooth[0]) * Floats::load_unaligned(centre + b * kLanes);
                derivative_of_smooth[b] = Floats(0.F);
            }
            constexpr std::ptrdiff_t to_smooth = kBandColumns, to_next = 2 * to_smooth;
            for (int k = 1; k <= job.radius; ++k) {
                const float* before = centre - (y > k ? k : y) * to_next;
                const float* after = centre + (y + k < job.height ? k : job.height - 1 - y) * to_next;
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
                smooth_of_derivative[b].store_unaligned(gx + x + b * kLanes);
                derivative_of_smooth[b].store_unaligned(gy + x + b * kLanes);
            }
        }
    };

    static void sum_columns(const BandJob& job, const Stretch& stretch, Sums (&channels)[2]) {
        alignas(64) float gradients[2][kBandColumns];
        for (int y = stretch.begin; y < stretch.end; ++y) {
            along_row(job.x1 - job.x0, ColumnPass{job, stretch, y, gradients[0], gradients[1]});
            const std::ptrdiff_t at = y * job.stride + job.x0;
            for (std::ptrdiff_t x = 0; x < job.x1 - job.x0; x += 16) {
                for (int channel = 0; channel < 2; ++channel) {
                    channels[channel].add(gradients[channel] + x, job.fixed[channel] + at + x, job.weights + at + x);
                }
            }
        }
    }
};

}  // namespace
}  // namespace raylign::detail::cpu
