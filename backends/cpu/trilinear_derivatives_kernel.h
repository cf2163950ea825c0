#pragma once

#include "backends/cpu/joseph_packet.h"
#include "backends/cpu/trilinear_kernel.h"

namespace raylign::cpu {
namespace {

/// Sums over a packet's samples of the field's slopes along x, y, z, and of the same times (k + 1/2), k the sample's
/// number.
template <class Arch>
struct alignas(64) TrilinearSlopes {
    static constexpr int count = Lanes<Arch>::count;
    float gradient[3][count], moment[3][count];
};

/// The midpoint rule with its pose derivatives. A sample's distance from the source is fixed, so the sample moves with
/// the ray: dI = step sum_k grad f . (ds + depth_k dray). See march_trilinear of the reference.
template <class Arch, class Voxel>
struct TrilinearDerivatives {
    using Plain = Trilinear<Arch, Voxel>;
    using L = Lanes<Arch>;
    using Floats = typename L::Floats;
    using Ints = typename L::Ints;
    using Packet = TrilinearPacket<Arch>;
    using Slopes = TrilinearSlopes<Arch>;

    static void cast(const CastJob& job) noexcept {
        Packet* packets = static_cast<Packet*>(job.scratch);
        Slopes* slopes = reinterpret_cast<Slopes*>(packets + L::packets_per_tile);
        const PlaneLayout& layout = job.layouts[2];
        const int count = Plain::collect(job, layout, packets);
        for (int i = 0; i < count; ++i) {
            slopes[i] = {};
            // Short runs, so that floats count from a near base and empty space is left out.
            const int run = layout.planes * layout.plane_stride > INT32_MAX ? 1 : kRun;  // as in Trilinear::cast
            for (double first = packets[i].first; first < packets[i].last; first += run) {
                march(layout, packets[i], slopes[i], first, static_cast<int>(minimum(packets[i].last - first, run)));
            }
            store(job, packets[i], slopes[i]);
        }
        Plain::store(job, packets, count);
    }

private:
    static constexpr int kRun = 32;

    /// The coordinates of a run of samples, from a base voxel on.
    struct Run {
        alignas(64) float start[3][L::count], step[3][L::count];
        int base[3];
        double low[3], high[3];

        Run(const PlaneLayout& layout, const Packet& packet, double first, int samples) {
            const int sizes[3] = {layout.columns, layout.rows, layout.planes};
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
        }
    };

    static void march(const PlaneLayout& layout, Packet& packet, Slopes& slopes, double first, int samples) {
        const int sizes[3] = {layout.columns, layout.rows, layout.planes};
        const Run run(layout, packet, first, samples);
        if (!Plain::is_any_occupied(layout, run.low, run.high)) return;
        const Voxel* voxels = static_cast<const Voxel*>(layout.origin) + run.base[2] * layout.plane_stride +
                              run.base[1] * layout.row_stride + run.base[0];
        alignas(64) float end[L::count];
        for (int i = 0; i < L::count; ++i) end[i] = static_cast<float>(packet.end[i] - first);
        const Floats zero(0.F);
        Floats sum(0.F), gradient[3] = {zero, zero, zero}, moment[3] = {zero, zero, zero};
        for (int k = 0; k < samples; ++k) {
            const Floats at(static_cast<float>(k));
            Floats raw[3], x[3];
            for (int axis = 0; axis < 3; ++axis) {
                raw[axis] = xsimd::fma(at, Floats::load_aligned(run.step[axis]), Floats::load_aligned(run.start[axis]));
                x[axis] =
                    xsimd::min(xsimd::max(raw[axis], zero), Floats(static_cast<float>(sizes[axis] - run.base[axis])));
            }
            Floats value, slope[3];
            interpolate(layout, voxels, x, value, slope);
            const auto counts = at < Floats::load_aligned(end);
            sum += xsimd::select(counts, value, zero);
            for (int axis = 0; axis < 3; ++axis) {
                const Floats kept = xsimd::select(counts && raw[axis] >= zero, slope[axis], zero);
                gradient[axis] += kept;
                moment[axis] = xsimd::fma(at, kept, moment[axis]);
            }
        }
        const Floats number(static_cast<float>(first + 0.5));
        const auto add_to = [](float* total, const Floats& part) {
            (Floats::load_aligned(total) + part).store_aligned(total);
        };
        add_to(packet.sum, sum);
        for (int axis = 0; axis < 3; ++axis) {
            add_to(slopes.gradient[axis], gradient[axis]);
            add_to(slopes.moment[axis], xsimd::fma(number, gradient[axis], moment[axis]));
        }
    }

    /// Value and slopes of the trilinear interpolant; coordinates are >= 0, so that truncation is floor.
    static void interpolate(const PlaneLayout& layout, const Voxel* voxels, const Floats (&x)[3], Floats& value,
                            Floats (&slope)[3]) {
        const Ints xi = xsimd::to_int(x[0]), yi = xsimd::to_int(x[1]), zi = xsimd::to_int(x[2]);
        const Floats fx = x[0] - xsimd::to_float(xi), fy = x[1] - xsimd::to_float(yi), fz = x[2] - xsimd::to_float(zi);
        const Ints index = zi * Ints(static_cast<std::int32_t>(layout.plane_stride)) +
                           yi * Ints(static_cast<std::int32_t>(layout.row_stride)) + xi;
        Floats plane_value[2], along_x[2], along_y[2];
        for (int plane = 0; plane < 2; ++plane, voxels += layout.plane_stride) {
            Floats v00, v01, v10, v11;
            Pairs<Arch>::load(voxels, index, v00, v01);
            Pairs<Arch>::load(voxels + layout.row_stride, index, v10, v11);
            const Floats v0 = xsimd::fma(fx, v01 - v00, v00), v1 = xsimd::fma(fx, v11 - v10, v10);
            plane_value[plane] = xsimd::fma(fy, v1 - v0, v0);
            along_x[plane] = xsimd::fma(fy, (v11 - v10) - (v01 - v00), v01 - v00);
            along_y[plane] = v1 - v0;
        }
        value = xsimd::fma(fz, plane_value[1] - plane_value[0], plane_value[0]);
        slope[0] = xsimd::fma(fz, along_x[1] - along_x[0], along_x[0]);
        slope[1] = xsimd::fma(fz, along_y[1] - along_y[0], along_y[0]);
        slope[2] = plane_value[1] - plane_value[0];
    }

    static void store(const CastJob& job, const Packet& packet, const Slopes& slopes) {
        const FrameDerivatives& d = *job.derivatives;
        const float scale = static_cast<float>(job.step_mm) * job.layouts[2].unit_per_mm;
        for (int i = 0; i < L::count; ++i) {
            if (!(packet.lanes >> i & 1)) continue;
            const int x = packet.x + i % L::width, y = packet.y + i / L::width;
            const float u = static_cast<float>(x), v = static_cast<float>(y);
            // |step| of a ray in mm of depth, from the axis that changes most.
            int a = __builtin_fabs(packet.step[1][i]) > __builtin_fabs(packet.step[0][i]) ? 1 : 0;
            if (__builtin_fabs(packet.step[2][i]) > __builtin_fabs(packet.step[a][i])) a = 2;
            const double ray = job.direction[a] + x * job.step_u[a] + y * job.step_v[a];
            const float depth_per_step = static_cast<float>(packet.step[a][i] / ray);
            for (int p = 0; p < kParameters; ++p) {
                float derivative = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const float dray = d.direction[p][axis] + u * d.step_u[p][axis] + v * d.step_v[p][axis];
                    derivative +=
                        slopes.gradient[axis][i] * d.source[p][axis] + depth_per_step * slopes.moment[axis][i] * dray;
                }
                job.image[(1 + p) * job.image_distance + y * job.image_stride + x] = scale * derivative;
            }
        }
    }
};

}  // namespace
}  // namespace raylign::cpu
