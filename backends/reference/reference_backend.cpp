#include "backends/reference/reference_backend.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/clock.h"
#include "core/geometry/dominant_axis.h"
#include "core/surface/surface_drr.h"

namespace raylign::detail {
namespace {

/// Voxel value, zero outside the lattice.
double value_at(const Volume& volume, const Eigen::Vector3i& voxel) {
    const bool inside = voxel.minCoeff() >= 0 && (volume.grid.size - voxel).minCoeff() > 0;
    return inside ? volume(voxel.x(), voxel.y(), voxel.z()) : 0;
}

/// Calls add(weights per axis, signs of the weights' slopes, voxel) for the 8 voxels around a point in voxel
/// coordinates.
template <class Add>
void for_corners(const Eigen::Vector3d& y, const Add& add) {
    const Eigen::Vector3d base = y.array().floor();
    const Eigen::Vector3d f = y - base;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3i d(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        const Eigen::Vector3d weight(d.x() ? f.x() : 1 - f.x(), d.y() ? f.y() : 1 - f.y(), d.z() ? f.z() : 1 - f.z());
        add(weight, 2 * d - Eigen::Vector3i::Ones(), base.cast<int>() + d);
    }
}

/// The trilinear interpolant of the zero-padded lattice. On a lattice plane it is that plane's bilinear interpolant,
/// which is what `joseph` needs.
double interpolate(const Volume& volume, const Eigen::Vector3d& y) {
    double sum = 0;
    for_corners(y, [&](const Eigen::Vector3d& weight, const Eigen::Vector3i&, const Eigen::Vector3i& voxel) {
        if (weight.prod() != 0) sum += weight.prod() * value_at(volume, voxel);
    });
    return sum;
}

/// Gradient of the interpolant [1/mm per voxel]; on a lattice plane, the component across it belongs to one side only.
Eigen::Vector3d interpolate_gradient(const Volume& volume, const Eigen::Vector3d& y) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for_corners(y, [&](const Eigen::Vector3d& w, const Eigen::Vector3i& sign, const Eigen::Vector3i& voxel) {
        sum += value_at(volume, voxel) *
               Eigen::Vector3d(sign.x() * w.y() * w.z(), sign.y() * w.x() * w.z(), sign.z() * w.x() * w.y());
    });
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

/// The samples of one ray: calls visit(position, depth) for each and returns the length [mm] that a sample stands for.
/// Joseph: the lattice planes of the dominant axis whose depth lies strictly between source and detector.
template <class Visit>
double march_joseph(const Volume& volume, const RayFrame& frame, const Eigen::Vector3d& ray, const Visit& visit) {
    const int axis = dominant_axis(ray);
    const double depth_per_plane = 1 / ray[axis];
    for (int plane = 0; plane < volume.grid.size[axis]; ++plane) {
        const double depth = (plane - frame.source_voxel[axis]) * depth_per_plane;
        if (!(depth > 0 && depth < frame.depth_max_mm)) continue;
        Eigen::Vector3d y = frame.source_voxel + depth * ray;
        y[axis] = plane;
        visit(y, depth);
    }
    return std::abs(depth_per_plane) * volume.grid.spacing_mm.cwiseProduct(ray).norm();
}

/// Midpoint rule: samples at distances (k + 1/2) step from the source. They do not depend on where the ray enters the
/// volume, so clipping cannot change the result and the derivative is exact (the field is continuous and zero at its
/// border).
template <class Visit>
double march_trilinear(const Volume& volume, const RayFrame& frame, const Eigen::Vector3d& ray, double step_mm,
                       const Visit& visit) {
    const double depth_per_step = step_mm / volume.grid.spacing_mm.cwiseProduct(ray).norm();
    const auto [begin, end] = depth_range(volume.grid, frame, ray);
    if (!(begin < end)) return step_mm;
    for (double k = std::max(0.0, std::floor(begin / depth_per_step - 0.5)); (k + 0.5) * depth_per_step < end; ++k) {
        visit(frame.source_voxel + (k + 0.5) * depth_per_step * ray, (k + 0.5) * depth_per_step);
    }
    return step_mm;
}

/// The DRR of a surface, and its derivatives.
std::vector<Image> drawn(const SurfaceDrr& surface, const RayFrame& frame, const RayFrameDerivatives* derivatives,
                         const Eigen::Vector2i& size_px) {
    const std::size_t count = derivatives ? 7 : 1, floats = static_cast<std::size_t>(size_px.prod());
    std::vector<float> all(count * floats);
    const SurfaceProjection seen = surface.project(frame, size_px);
    for (std::size_t band = 0; band < seen.bands.size(); ++band) {
        surface.draw(seen, frame, derivatives, band, {all.data(), size_px.x(), static_cast<std::ptrdiff_t>(floats)});
    }
    std::vector<Image> images(count, Image(size_px.x(), size_px.y()));
    for (std::size_t i = 0; i < count; ++i) std::copy_n(&all[i * floats], floats, images[i].pixels.begin());
    return images;
}

class ReferenceSession final : public Session {
public:
    explicit ReferenceSession(const Scene& scene)
        : Session(scene),
          shared_volume_(std::make_shared<const Volume>(scene.volume)),
          render_(scene.render),
          similarity_(scene.similarity) {
        for (const View& view : scene.views) sizes_px_.push_back(view.geometry.camera.size_px);
    }
    ReferenceSession(const ReferenceSession& resident, std::span<const View> views, const Similarity& similarity)
        : Session(resident, views, similarity),
          shared_volume_(resident.shared_volume_),
          render_(resident.render_),
          similarity_(similarity) {
        for (const View& view : views) sizes_px_.push_back(view.geometry.camera.size_px);
    }

    std::size_t volume_bytes() const override { return volume_.attenuation_per_mm.size() * sizeof(float); }
    std::unique_ptr<Session> with_views(std::span<const View> views, const Similarity& similarity) override {
        return std::make_unique<ReferenceSession>(*this, views, similarity);
    }

protected:
    void weights_changed() override {}  // it reads fixed() itself

    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override {
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const Image drr = render_frame(frames[i]);
            auto start = Clock::now();
            const std::vector<Image> moving = detail::moving_channels(drr, similarity_);
            timing_.gradient_s += seconds_since(start);
            start = Clock::now();
            const FixedChannels& fixed_view = fixed()[frames[i].view];
            for (std::size_t c = 0; c < moving.size(); ++c) {
                sums[i * moving.size() + c] =
                    detail::moment_sums(fixed_view.channels[c], moving[c], fixed_view.weights);
            }
            timing_.reduction_s += seconds_since(start);
        }
    }

    void accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                    std::span<JacobianSums> sums) override {
        for (std::size_t i = 0; i < frames.size(); ++i) {
            const DrrWithDerivatives made = render_frame(frames[i], derivatives[i]);
            const std::vector<Image> moving = detail::moving_channels(made.drr, similarity_);
            // The filter is linear: it applies to each derivative.
            std::vector<std::array<Image, 6>> jacobian(moving.size());
            for (int p = 0; p < 6; ++p) {
                std::vector<Image> channels = detail::moving_channels(made.derivatives[p], similarity_);
                for (std::size_t c = 0; c < moving.size(); ++c) jacobian[c][p] = std::move(channels[c]);
            }
            const FixedChannels& fixed_view = fixed()[frames[i].view];
            for (std::size_t c = 0; c < moving.size(); ++c) {
                sums[i * moving.size() + c] =
                    jacobian_sums(fixed_view.channels[c], moving[c], jacobian[c], fixed_view.weights);
            }
        }
    }

    Image render_frame(const RayFrame& frame) override {
        const auto start = Clock::now();
        Image drr(sizes_px_[frame.view].x(), sizes_px_[frame.view].y());
        if (surface()) {
            drr = std::move(drawn(*surface(), frame, nullptr, sizes_px_[frame.view]).front());
            timing_.drr_s += seconds_since(start);
            return drr;
        }
        for (int v = 0; v < drr.height; ++v) {
            for (int u = 0; u < drr.width; ++u) {
                double sum = 0;
                const double length_mm = march(frame, frame.ray_voxel(u, v), [&](const Eigen::Vector3d& y, double) {
                    sum += interpolate(volume_, y);
                });
                drr(u, v) =
                    saturated(static_cast<float>(sum * length_mm), static_cast<float>(frame.ceiling)).line_integral;
            }
        }
        timing_.drr_s += seconds_since(start);
        return drr;
    }

    DrrWithDerivatives render_frame(const RayFrame& frame, const RayFrameDerivatives& derivatives) override {
        if (!surface()) return {render_frame(frame), render_derivatives(frame, derivatives)};
        std::vector<Image> images = drawn(*surface(), frame, &derivatives, sizes_px_[frame.view]);
        DrrWithDerivatives made{std::move(images.front()), {}};
        std::move(images.begin() + 1, images.end(), made.derivatives.begin());
        return made;
    }

private:
    template <class Visit>
    double march(const RayFrame& frame, const Eigen::Vector3d& ray, const Visit& visit) const {
        if (render_.projector == Projector::joseph) return march_joseph(volume_, frame, ray, visit);
        return march_trilinear(volume_, frame, ray, trilinear_step_mm(render_, volume_.grid), visit);
    }

    /// The six images dI / dp_i.
    std::array<Image, 6> render_derivatives(const RayFrame& frame, const RayFrameDerivatives& derivatives) const {
        const Eigen::Vector2i size_px = sizes_px_[frame.view];
        std::array<Image, 6> images;
        images.fill(Image(size_px.x(), size_px.y()));
        for (int v = 0; v < size_px.y(); ++v) {
            for (int u = 0; u < size_px.x(); ++u) {
                const Eigen::Vector3d ray = frame.ray_voxel(u, v);
                double sum = 0;
                // Sums of grad f and of depth grad f.
                Eigen::Vector3d g0 = Eigen::Vector3d::Zero(), g1 = Eigen::Vector3d::Zero();
                const double length_mm = march(frame, ray, [&](const Eigen::Vector3d& y, double depth) {
                    const Eigen::Vector3d gradient = interpolate_gradient(volume_, y);
                    sum += interpolate(volume_, y);
                    g0 += gradient;
                    g1 += depth * gradient;
                });
                const float shown =
                    saturated(static_cast<float>(sum * length_mm), static_cast<float>(frame.ceiling)).slope;
                for (int p = 0; p < 6; ++p) {
                    const Eigen::Vector3d& ds = derivatives[p].source_voxel;
                    const Eigen::Vector3d dd = derivatives[p].ray_voxel(u, v);
                    double derivative = g0.dot(ds) + g1.dot(dd);
                    if (render_.projector == Projector::joseph) {
                        // The sample stays in its plane, so its depth changes by -(ds_a + depth dd_a) / d_a; and so
                        // does the length per plane, by -dd_a / d_a of itself (a rotation keeps |spacing .* d|).
                        const int a = dominant_axis(ray);
                        derivative -= (g0.dot(ray) * ds[a] + g1.dot(ray) * dd[a] + sum * dd[a]) / ray[a];
                    }
                    images[p](u, v) = shown * static_cast<float>(derivative * length_mm);
                }
            }
        }
        return images;
    }

    std::shared_ptr<const Volume> shared_volume_;
    const Volume& volume_ = *shared_volume_;
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

}  // namespace raylign::detail
