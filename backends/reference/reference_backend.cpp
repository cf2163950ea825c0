#include "backends/reference/reference_backend.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "core/geometry/dominant_axis.h"

namespace raylign {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Voxel value, zero outside the lattice.
double voxel(const Volume& volume, int x, int y, int z) {
    const Eigen::Vector3i& n = volume.grid.size;
    const bool inside = x >= 0 && y >= 0 && z >= 0 && x < n.x() && y < n.y() && z < n.z();
    return inside ? volume(x, y, z) : 0;
}

/// The trilinear interpolant of the zero-padded lattice at a point in voxel coordinates. On a lattice plane it is the
/// bilinear interpolant of that plane, which is what `joseph` needs.
double interpolate(const Volume& volume, const Eigen::Vector3d& y) {
    const Eigen::Vector3d base = y.array().floor();
    const Eigen::Vector3d f = y - base;
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2 & 1;
        const double weight = (dx ? f.x() : 1 - f.x()) * (dy ? f.y() : 1 - f.y()) * (dz ? f.z() : 1 - f.z());
        if (weight == 0) continue;
        sum += weight * voxel(volume, static_cast<int>(base.x()) + dx, static_cast<int>(base.y()) + dy,
                              static_cast<int>(base.z()) + dz);
    }
    return sum;
}

/// Depths at which a ray is inside the support (-1, n)^3 and between source and detector; empty if begin >= end.
struct DepthRange {
    double begin, end;
};

DepthRange depth_range(const VoxelGrid& grid, const RayFrame& frame, const Eigen::Vector3d& ray) {
    DepthRange range{0, frame.depth_max_mm};
    for (int axis = 0; axis < 3; ++axis) {
        const double low = -1 - frame.source_voxel[axis], high = grid.size[axis] - frame.source_voxel[axis];
        if (ray[axis] == 0) {  // parallel: inside the slab everywhere or nowhere (0 * inf must not decide)
            if (!(low < 0 && high > 0)) return {0, 0};
            continue;
        }
        const double a = low / ray[axis], b = high / ray[axis];
        range.begin = std::max(range.begin, std::min(a, b));
        range.end = std::min(range.end, std::max(a, b));
    }
    return range;
}

/// Joseph: sum over lattice planes k of the dominant axis of the plane's bilinear value, times the ray's length per plane.
/// A plane counts if its depth lies strictly between source and detector.
double joseph_integral(const Volume& volume, const RayFrame& frame, const Eigen::Vector3d& ray) {
    const int axis = dominant_axis(ray);
    const double depth_per_plane = 1 / ray[axis];
    double sum = 0;
    for (int plane = 0; plane < volume.grid.size[axis]; ++plane) {
        const double depth = (plane - frame.source_voxel[axis]) * depth_per_plane;
        if (!(depth > 0 && depth < frame.depth_max_mm)) continue;
        Eigen::Vector3d y = frame.source_voxel + depth * ray;
        y[axis] = plane;
        sum += interpolate(volume, y);
    }
    return sum * std::abs(depth_per_plane) * volume.grid.spacing_mm.cwiseProduct(ray).norm();
}

/// Midpoint rule: samples at distances (k + 1/2) step from the source. They do not depend on where the ray enters the volume,
/// so clipping cannot change the result and the derivative is exact (the field is continuous and zero at its border).
double trilinear_integral(const Volume& volume, const RayFrame& frame, const Eigen::Vector3d& ray, double step_mm) {
    const double mm_per_depth = volume.grid.spacing_mm.cwiseProduct(ray).norm();
    const double depth_per_step = step_mm / mm_per_depth;
    const auto [begin, end] = depth_range(volume.grid, frame, ray);
    if (!(begin < end)) return 0;
    double sum = 0;
    for (double k = std::max(0.0, std::floor(begin / depth_per_step - 0.5)); (k + 0.5) * depth_per_step < end; ++k) {
        sum += interpolate(volume, frame.source_voxel + (k + 0.5) * depth_per_step * ray);
    }
    return sum * step_mm;
}

class ReferenceSession final : public Session {
public:
    explicit ReferenceSession(const Scene& scene)
        : Session(scene), volume_(scene.volume), render_(scene.render), similarity_(scene.similarity) {
        for (const View& view : scene.views) sizes_px_.push_back(view.geometry.camera.size_px);
    }

    std::size_t volume_bytes() const override { return volume_.attenuation_per_mm.size() * sizeof(float); }

protected:
    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override {
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const Image drr = render_frame(frames[i]);
            auto start = std::chrono::steady_clock::now();
            const std::vector<Image> moving = moving_channels(drr, similarity_);
            timing_.gradient_s += seconds_since(start);
            start = std::chrono::steady_clock::now();
            const FixedChannels& fixed_view = fixed()[frames[i].view];
            for (std::size_t c = 0; c < moving.size(); ++c) {
                sums[i * moving.size() + c] =
                    raylign::moment_sums(fixed_view.channels[c], moving[c], fixed_view.weights);
            }
            timing_.reduction_s += seconds_since(start);
        }
    }

    Image render_frame(const RayFrame& frame) override {
        const auto start = std::chrono::steady_clock::now();
        const double step_mm = trilinear_step_mm(render_, volume_.grid);
        Image drr(sizes_px_[frame.view].x(), sizes_px_[frame.view].y());
        for (int v = 0; v < drr.height; ++v) {
            for (int u = 0; u < drr.width; ++u) {
                const Eigen::Vector3d ray = frame.ray_voxel(u, v);
                drr(u, v) = static_cast<float>(render_.projector == Projector::joseph
                                                   ? joseph_integral(volume_, frame, ray)
                                                   : trilinear_integral(volume_, frame, ray, step_mm));
            }
        }
        timing_.drr_s += seconds_since(start);
        return drr;
    }

private:
    Volume volume_;
    RenderSettings render_;
    Similarity similarity_;
    std::vector<Eigen::Vector2i> sizes_px_;
};

class ReferenceBackend final : public Backend {
public:
    BackendInfo info() const override {
        return {.name = "reference",
                .summary = "scalar, double, one thread: the oracle that the others are checked against",
                .device = "host processor",
                .threads = 1,
                .instruction_set = "scalar"};
    }
    std::unique_ptr<Session> prepare(const Scene& scene) override { return std::make_unique<ReferenceSession>(scene); }
};

}  // namespace

std::unique_ptr<Backend> make_reference_backend() { return std::make_unique<ReferenceBackend>(); }

}  // namespace raylign
