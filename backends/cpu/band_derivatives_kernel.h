#pragma once

#include "backends/cpu/band_kernel.h"

namespace raylign::detail::cpu {
namespace {

/// Filter and sums of one band of rows of a DRR and its six derivative images: what a Gauss-Newton step needs
/// (JacobianSums). The filter is linear, so it applies to each derivative image as to the DRR itself.
template <class Arch>
struct BandDerivatives {
    using Floats = typename Lanes<Arch>::Floats;
    using Plain = Band<Arch>;
    static constexpr int kLanes = Lanes<Arch>::count;

    static void sum(const BandJob& job, BandDerivativeSums* sums) noexcept {
        Totals totals[2];
        if (job.channels == 2) {
            for (int i = 0; i < kImages; ++i) Plain::filter_rows(job_of(job, i));
        }
        for (std::ptrdiff_t x = 0; x < job.stride; x += kBandColumns) {
            const std::ptrdiff_t end = x + kBandColumns < job.stride ? x + kBandColumns : job.stride;
            if (job.channels == 2) filter_columns(job, x, end);
            for (int channel = 0; channel < job.channels; ++channel) {
                for (int y = job.y0; y < job.y1; y += kRows) {
                    const Patch patch(job, channel, x, end, y, y + kRows < job.y1 ? y + kRows : job.y1);
                    add_first_order(patch, totals[channel]);
                    add_products<0>(patch, totals[channel]);
                    add_products<1>(patch, totals[channel]);
                    add_products<2>(patch, totals[channel]);
                }
            }
        }
        for (int channel = 0; channel < job.channels; ++channel) sums[channel] = totals[channel].sums();
    }

private:
    static constexpr int kImages = 1 + kParameters;
    /// Rows whose products are summed in float, lane by lane, before double takes over: 32 floats a lane with 16 lanes,
    /// to 1e-6 of the sum at worst.
    static constexpr int kRows = 8;

    static const float* image_of(const BandJob& job, int i) { return job.image + i * job.image_distance; }

    /// A job for image i alone, with scratch of its own.
    static BandJob job_of(const BandJob& job, int i) {
        BandJob one = job;
        one.image = image_of(job, i);
        one.scratch = job.scratch + i * job.scratch_distance;
        return one;
    }

    /// Gradients of kBandColumns columns of image i, the band's rows below each other, behind all that filter_rows
    /// uses.
    static float* gradients(const BandJob& job, int i, int channel) {
        return job.scratch + kImages * job.scratch_distance + std::ptrdiff_t{2 * i + channel} * kGradientFloats;
    }

    static void filter_columns(const BandJob& job, std::ptrdiff_t x, std::ptrdiff_t end) {
        for (int i = 0; i < kImages; ++i) {
            const BandJob one = job_of(job, i);
            float *gx = gradients(job, i, 0), *gy = gradients(job, i, 1);
            for (int y = job.y0; y < job.y1; ++y, gx += kBandColumns, gy += kBandColumns) {
                Plain::along_row(x, end, typename Plain::ColumnPass{one, y, x, gx, gy});
            }
        }
    }

    /// Some columns and rows of one channel of all images.
    struct Patch {
        const float *images[kImages], *fixed, *weights;
        std::ptrdiff_t image_stride, stride, columns;
        int rows;

        Patch(const BandJob& job, int channel, std::ptrdiff_t x, std::ptrdiff_t end, int y, int y_end)
            : stride(job.stride), columns(end - x), rows(y_end - y) {
            const std::ptrdiff_t at = y * job.stride + x;
            fixed = job.fixed[channel] + at;
            weights = job.weights + at;
            image_stride = job.channels == 2 ? kBandColumns : job.stride;
            for (int i = 0; i < kImages; ++i) {
                images[i] = job.channels == 2 ? gradients(job, i, channel) + std::ptrdiff_t{y - job.y0} * kBandColumns
                                              : image_of(job, i) + at;
            }
        }
    };

    /// Sums by lane. First-order products come in this order: image, times the image, times the fixed one.
    struct Totals {
        static constexpr int kFirst = 3 * kImages, kSecond = kParameters * (kParameters + 1) / 2;
        FourDoubles lanes[kFirst + kSecond][kLanes / 4] = {};

        void add(int k, const Floats& sum) {
            alignas(64) float values[kLanes];
            sum.store_aligned(values);
            for (int i = 0; i < kLanes / 4; ++i) {
                FourDoubles four;
                load_four(values + 4 * i, four);
                lanes[k][i] += four;
            }
        }
        [[nodiscard]] double total(int k) const { return total_of(lanes[k]); }
        [[nodiscard]] BandDerivativeSums sums() const {
            BandDerivativeSums sums{total(0), total(1), total(2), {}, {}, {}, {}};
            for (int i = 0; i < kParameters; ++i) {
                sums.jacobian[i] = total(3 + 3 * i);
                sums.moving_jacobian[i] = total(4 + 3 * i);
                sums.fixed_jacobian[i] = total(5 + 3 * i);
            }
            for (int k = 0; k < kSecond; ++k) sums.jacobian_jacobian[k] = total(kFirst + k);
            return sums;
        }
    };

    static void add_first_order(const Patch& patch, Totals& totals) {
        Floats sums[Totals::kFirst];
        for (Floats& sum : sums) sum = Floats(0.F);
        for (int row = 0; row < patch.rows; ++row) {
            for (std::ptrdiff_t x = 0; x < patch.columns; x += kLanes) {
                const std::ptrdiff_t at = row * patch.stride + x, image_at = row * patch.image_stride + x;
                const Floats weight = Floats::load_unaligned(patch.weights + at),
                             a = Floats::load_unaligned(patch.fixed + at),
                             b = Floats::load_unaligned(patch.images[0] + image_at);
                for (int i = 0; i < kImages; ++i) {
                    const Floats weighted = weight * Floats::load_unaligned(patch.images[i] + image_at);
                    sums[3 * i] += weighted;
                    sums[3 * i + 1] = fused(weighted, b, sums[3 * i + 1]);
                    sums[3 * i + 2] = fused(weighted, a, sums[3 * i + 2]);
                }
            }
        }
        for (int k = 0; k < Totals::kFirst; ++k) totals.add(k, sums[k]);
    }

    /// The derivatives i and 5 - i times themselves and those after them: seven sums, for any i.
    template <int i>
    static void add_products(const Patch& patch, Totals& totals) {
        constexpr int kLast = kParameters - 1, kOther = kLast - i;
        Floats sums[kParameters - i], others[1 + i];
        for (Floats& sum : sums) sum = Floats(0.F);
        for (Floats& sum : others) sum = Floats(0.F);
        for (int row = 0; row < patch.rows; ++row) {
            for (std::ptrdiff_t x = 0; x < patch.columns; x += kLanes) {
                const std::ptrdiff_t at = row * patch.image_stride + x;
                const Floats weight = Floats::load_unaligned(patch.weights + row * patch.stride + x),
                             weighted = weight * Floats::load_unaligned(patch.images[1 + i] + at),
                             other = weight * Floats::load_unaligned(patch.images[1 + kOther] + at);
                for (int j = i; j <= kLast; ++j) {
                    const Floats derivative = Floats::load_unaligned(patch.images[1 + j] + at);
                    sums[j - i] = fused(weighted, derivative, sums[j - i]);
                    if (j >= kOther) others[j - kOther] = fused(other, derivative, others[j - kOther]);
                }
            }
        }
        constexpr auto first = [](int p) { return Totals::kFirst + p * kParameters - p * (p - 1) / 2; };
        for (int k = 0; k < kParameters - i; ++k) totals.add(first(i) + k, sums[k]);
        for (int k = 0; k < 1 + i; ++k) totals.add(first(kOther) + k, others[k]);
    }
};

}  // namespace
}  // namespace raylign::detail::cpu
