#pragma once

#include "backends/cpu/band_kernel.h"

namespace raylign::cpu {
namespace {

/// Filter and sums of one band of rows of a DRR and its six derivative images: what a Gauss-Newton step needs
/// (JacobianSums). The filter is linear, so it applies to each derivative image as to the DRR itself.
template <class Arch>
struct BandDerivatives {
    using Floats = typename Lanes<Arch>::Floats;
    using Plain = Band<Arch>;
    static constexpr int kLanes = Lanes<Arch>::count;

    static void sum(const BandJob& job, BandDerivativeSums* sums) noexcept {
        for (int channel = 0; channel < job.channels; ++channel) sums[channel] = {};
        if (job.channels == 2) filter_all_rows(job);
        for (int y = job.y0; y < job.y1; ++y) {
            const std::ptrdiff_t at = y * job.stride;
            if (job.channels == 2) filter_all_columns(job, y);
            for (int channel = 0; channel < job.channels; ++channel) {
                const float* images[1 + kParameters];
                for (int i = 0; i <= kParameters; ++i) {
                    images[i] = job.channels == 2 ? filtered_row(job, i, channel) : image_of(job, i) + at;
                }
                add_row(job, images, job.fixed[channel] + at, job.weights + at, sums[channel]);
            }
        }
    }

private:
    static const float* image_of(const BandJob& job, int i) { return job.image + i * job.image_distance; }

    /// A job for image i alone, with scratch of its own.
    static BandJob job_of(const BandJob& job, int i) {
        BandJob one = job;
        one.image = image_of(job, i);
        one.scratch = job.scratch + i * job.scratch_distance;
        return one;
    }

    /// One filtered row of image i, behind the row-filtered bands of all images.
    static float* filtered_row(const BandJob& job, int i, int channel) {
        return job.scratch + (1 + kParameters) * job.scratch_distance + (2 * i + channel) * job.stride;
    }

    static void filter_all_rows(const BandJob& job) {
        for (int i = 0; i <= kParameters; ++i) Plain::filter_rows(job_of(job, i));
    }

    static void filter_all_columns(const BandJob& job, int y) {
        for (int i = 0; i <= kParameters; ++i) {
            const BandJob one = job_of(job, i);
            float *gx = filtered_row(job, i, 0), *gy = filtered_row(job, i, 1);
            for (std::ptrdiff_t x = 0; x < job.stride; x += kLanes) Plain::filter_column(one, x, y, gx + x, gy + x);
        }
    }

    /// Products of a row summed in float, rows in double: 16 lanes share a row of some hundred pixels, so that a lane
    /// adds a few dozen floats, to 1e-6 of the sum at worst.
    static void add_row(const BandJob& job, const float* const* images, const float* fixed, const float* weights,
                        BandDerivativeSums& sums) {
        add(sums.moving, job, weights, images[0], nullptr);
        add(sums.moving_moving, job, weights, images[0], images[0]);
        add(sums.fixed_moving, job, weights, images[0], fixed);
        int k = 0;
        for (int i = 0; i < kParameters; ++i) {
            const float* derivative = images[1 + i];
            add(sums.jacobian[i], job, weights, derivative, nullptr);
            add(sums.fixed_jacobian[i], job, weights, derivative, fixed);
            add(sums.moving_jacobian[i], job, weights, derivative, images[0]);
            for (int j = i; j < kParameters; ++j, ++k) {
                add(sums.jacobian_jacobian[k], job, weights, derivative, images[1 + j]);
            }
        }
    }

    static void add(double& sum, const BandJob& job, const float* weights, const float* a, const float* b) {
        alignas(64) float lanes[kLanes];
        Floats total(0.F);
        for (std::ptrdiff_t x = 0; x < job.stride; x += kLanes) {
            const Floats weighted = Floats::load_unaligned(weights + x) * Floats::load_unaligned(a + x);
            total = b ? xsimd::fma(weighted, Floats::load_unaligned(b + x), total) : total + weighted;
        }
        total.store_aligned(lanes);
        for (const float lane : lanes) sum += lane;
    }
};

}  // namespace
}  // namespace raylign::cpu
