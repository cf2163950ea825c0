#pragma once

#include "backends/cpu/band_kernel.h"

namespace raylign::detail::cpu {
namespace {

/// Filter and sums of one band of a DRR and its six derivative images: what a Gauss-Newton step needs
/// (JacobianSums). The filter is linear, so it applies to each derivative image as to the DRR itself.
template <class Arch>
struct BandDerivatives {
    using Floats = typename Lanes<Arch>::Floats;
    using Plain = Band<Arch>;
    using Stretch = typename Plain::Stretch;
    using FilteredRows = typename Plain::FilteredRows;
    static constexpr int kLanes = Lanes<Arch>::count;

    static void sum(const BandJob& job, BandDerivativeSums* sums) noexcept {
        Totals totals[2];
        FilteredRows rows[kImages];
        for (int y = job.y0; y < job.y1; y += kStretchRows) {
            const Stretch stretch(job, y);
            if (!Plain::has_weight(job, stretch) || all_zero(job, stretch)) continue;
            for (int i = 0; i < kImages && job.channels == 2; ++i) filter(job, stretch, i, rows[i]);
            for (int channel = 0; channel < job.channels; ++channel) {
                for (int row = stretch.begin; row < stretch.end; row += kRows) {
                    const Patch patch(job, stretch, channel, row,
                                      row + kRows < stretch.end ? row + kRows : stretch.end);
                    add_first_order<0, 4>(patch, totals[channel]);
                    add_first_order<4, kImages>(patch, totals[channel]);
                    add_products<0, 1>(patch, totals[channel]);
                    add_products<2, 3, 4, 5>(patch, totals[channel]);
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

    static bool all_zero(const BandJob& job, const Stretch& stretch) {
        for (int i = 0; i < kImages; ++i) {
            if (!Plain::is_zero(job_of(job, i), stretch)) return false;
        }
        return true;
    }

    /// Gradients of a stretch of image i, its rows below each other, behind all that is filtered.
    static float* gradients(const BandJob& job, int i, int channel) {
        return job.scratch + kImages * job.scratch_distance + std::ptrdiff_t{2 * i + channel} * kGradientFloats;
    }

    static void filter(const BandJob& job, const Stretch& stretch, int i, FilteredRows& rows) {
        const BandJob one = job_of(job, i);
        rows.filter(one, stretch);
        float *gx = gradients(job, i, 0), *gy = gradients(job, i, 1);
        for (int y = stretch.begin; y < stretch.end; ++y, gx += kBandColumns, gy += kBandColumns) {
            Plain::along_row(job.x1 - job.x0, typename Plain::ColumnPass{one, stretch, y, gx, gy});
        }
    }

    /// Some rows of one channel of all images.
    struct Patch {
        const float *images[kImages], *fixed, *weights;
        std::ptrdiff_t image_stride, stride, columns;
        int rows;

        Patch(const BandJob& job, const Stretch& stretch, int channel, int y, int y_end)
            : stride(job.stride), columns(job.x1 - job.x0), rows(y_end - y) {
            const std::ptrdiff_t at = y * job.stride + job.x0;
            fixed = job.fixed[channel] + at;
            weights = job.weights + at;
            image_stride = job.channels == 2 ? kBandColumns : job.stride;
            for (int i = 0; i < kImages; ++i) {
                images[i] = job.channels == 2
                                ? gradients(job, i, channel) + std::ptrdiff_t{y - stretch.begin} * kBandColumns
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

    /// Of the images [begin, end): as many sums as the smallest set of registers holds.
    template <int begin, int end>
    static void add_first_order(const Patch& patch, Totals& totals) {
        Floats sums[3 * (end - begin)];
        for (Floats& sum : sums) sum = Floats(0.F);
        for (int row = 0; row < patch.rows; ++row) {
            for (std::ptrdiff_t x = 0; x < patch.columns; x += kLanes) {
                const std::ptrdiff_t at = row * patch.stride + x, image_at = row * patch.image_stride + x;
                const Floats weight = Floats::load_unaligned(patch.weights + at),
                             a = Floats::load_unaligned(patch.fixed + at),
                             b = Floats::load_unaligned(patch.images[0] + image_at);
                for (int i = 0; i < end - begin; ++i) {
                    const Floats weighted = weight * Floats::load_unaligned(patch.images[begin + i] + image_at);
                    sums[3 * i] += weighted;
                    sums[3 * i + 1] = fused(weighted, b, sums[3 * i + 1]);
                    sums[3 * i + 2] = fused(weighted, a, sums[3 * i + 2]);
                }
            }
        }
        for (int k = 0; k < 3 * (end - begin); ++k) totals.add(3 * begin + k, sums[k]);
    }

    /// Derivative i times itself and those after it.
    template <int i>
    struct Products {
        Floats sums[kParameters - i];

        Products() {
            for (Floats& sum : sums) sum = Floats(0.F);
        }
        void add(const Patch& patch, const Floats& weight, std::ptrdiff_t at) {
            const Floats weighted = weight * Floats::load_unaligned(patch.images[1 + i] + at);
            for (int j = i; j < kParameters; ++j) {
                sums[j - i] = fused(weighted, Floats::load_unaligned(patch.images[1 + j] + at), sums[j - i]);
            }
        }
        void add_to(Totals& totals) const {
            constexpr int kPlace = Totals::kFirst + i * kParameters - i * (i - 1) / 2;
            for (int k = 0; k < kParameters - i; ++k) totals.add(kPlace + k, sums[k]);
        }
    };
    template <int... i>
    struct AllProducts : Products<i>... {};

    /// The products of derivatives i: ten or eleven sums at once.
    template <int... i>
    static void add_products(const Patch& patch, Totals& totals) {
        AllProducts<i...> products;
        for (int row = 0; row < patch.rows; ++row) {
            for (std::ptrdiff_t x = 0; x < patch.columns; x += kLanes) {
                const Floats weight = Floats::load_unaligned(patch.weights + row * patch.stride + x);
                (static_cast<Products<i>&>(products).add(patch, weight, row * patch.image_stride + x), ...);
            }
        }
        (static_cast<const Products<i>&>(products).add_to(totals), ...);
    }
};

}  // namespace
}  // namespace raylign::detail::cpu
