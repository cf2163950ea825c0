#include "backends/cpu/cpu_session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/clock.h"
#include "core/geometry/dominant_axis.h"
#include "core/image/gradient_filter.h"

namespace raylign::detail::cpu {
namespace {

/// Images that are in work at once where threads share them: 64 MiB of floats at most.
constexpr std::size_t kImagesInWork = std::size_t{16} << 20;

/// The axis that the first view looks along at the identity pose: its layout is the one made first.
int first_axis(const Scene& scene) {
    const ViewGeometry& view = scene.views.front().geometry;
    const RayFrame frame = make_ray_frame(scene.volume.grid, view, {});
    const Eigen::Vector2d centre = (view.camera.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
    return dominant_axis(frame.ray_voxel(centre.x(), centre.y()));
}

JacobianSums jacobian_sums_of(const BandDerivativeSums& band) {
    JacobianSums sums;
    sums.moments.moving = band.moving;
    sums.moments.moving_moving = band.moving_moving;
    sums.moments.fixed_moving = band.fixed_moving;
    std::ranges::copy(band.jacobian, sums.jacobian.begin());
    std::ranges::copy(band.fixed_jacobian, sums.fixed_jacobian.begin());
    std::ranges::copy(band.moving_jacobian, sums.moving_jacobian.begin());
    std::ranges::copy(band.jacobian_jacobian, sums.jacobian_jacobian.begin());
    return sums;
}

/// What a detector that saturates shows of the tile's DRR, and of its derivatives. Pixels that nobody needs hold what
/// was there before: that does no harm.
void saturate(const CastJob& job, float ceiling) {
    const Saturated air = saturated(0, ceiling);
    for (int y = job.y0; y < job.y1; ++y) {
        for (int x = job.x0; x < job.x1; ++x) {
            float* const pixel = job.image + y * job.image_stride + x;
            const Saturated shown = *pixel > 0 ? saturated(*pixel, ceiling) : air;
            *pixel = shown.line_integral;
            if (job.derivatives == nullptr) continue;
            for (int p = 1; p <= kParameters; ++p) pixel[p * job.image_distance] *= shown.slope;
        }
    }
}

}  // namespace

CpuSession::CpuSession(const Scene& scene, const KernelTable& kernels, const StorageRule& storage, int threads)
    : Session(scene),
      kernels_(kernels),
      workers_(threads),
      grid_(scene.volume.grid),
      render_(scene.render),
      step_mm_(trilinear_step_mm(scene.render, scene.volume.grid)),
      channels_(channel_count()) {
    const auto start = Clock::now();
    make_plans(scene.views, scene.similarity);
    if (!surface()) {
        layouts_ = std::make_shared<VolumeLayouts>(
            make_layouts(scene.volume, storage, all_axes() ? first_axis(scene) : 2, workers_));
    }
    timing_.prepare_s += seconds_since(start);
}

CpuSession::CpuSession(const CpuSession& resident, std::span<const View> views, const Similarity& similarity)
    : Session(resident, views, similarity),
      kernels_(resident.kernels_),
      workers_(resident.workers_.threads()),
      grid_(resident.grid_),
      render_(resident.render_),
      step_mm_(resident.step_mm_),
      channels_(channel_count()),
      layouts_(resident.layouts_) {
    const auto start = Clock::now();
    make_plans(views, similarity);
    timing_.prepare_s += seconds_since(start);
}

std::unique_ptr<Session> CpuSession::with_views(std::span<const View> views, const Similarity& similarity) {
    return std::make_unique<CpuSession>(*this, views, similarity);
}

/// All that depends on the views: their plans, and what threads work in.
void CpuSession::make_plans(std::span<const View> views, const Similarity& similarity) {
    if (similarity.metric == Metric::gc) {
        const GradientTaps taps = gradient_taps(similarity.filter);
        radius_ = taps.radius_px;
        smooth_.assign(taps.smooth.begin() + radius_, taps.smooth.end());
        derivative_.assign(taps.derivative.begin() + radius_, taps.derivative.end());
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
        views_.push_back(make_view_plan(views[i].geometry.camera.size_px));
        if (!fixed().empty()) {
            plan_channels(views_.back(), fixed()[i]);
            plan_weights(views_.back(), fixed()[i], radius_);
        }
        image_floats_ = std::max(image_floats_, views_.back().image_floats());
        bands_ = std::max(bands_, static_cast<std::size_t>(views_.back().bands()));
    }
    slots_.resize(workers_.threads());
    for (Slot& slot : slots_) {
        slot.cast_scratch = PageBuffer(kernels_.scratch_bytes, "a thread's rays");
        if (!fixed().empty()) slot.band_scratch.assign(band_scratch_floats(radius_) + kAlignFloats, 0.F);
    }
}

void CpuSession::weights_changed() {
    for (std::size_t i = 0; i < views_.size(); ++i) plan_weights(views_[i], fixed()[i], radius_);
}

bool CpuSession::all_axes() const { return render_.projector == Projector::joseph || kernels_.trilinear_by_planes; }

/// Most poses need one or two of the three axes, so layouts are made when a ray first asks for them.
void CpuSession::make_layouts_for(const RayFrame& frame) {
    if (surface() || !all_axes() || axes_made_ == 7) return;
    const unsigned axes = axes_met(frame, views_[frame.view].size_px, axes_made_);
    if (axes == 0) return;
    const auto start = Clock::now();
    for (int axis = 0; axis < 3; ++axis) {
        if (axes >> axis & 1) layouts_->make(axis, workers_);
    }
    axes_made_ |= axes;
    timing_.prepare_s += seconds_since(start);
}

void CpuSession::cast_tile(const RayFrame& frame, const FrameDerivatives* derivatives, int tile, float* image,
                           std::ptrdiff_t stride, bool only_needed, Slot& slot) {
    const auto start = Clock::now();
    const ViewPlan& view = views_[frame.view];
    CastJob job = cast_job(frame, view.size_px, grid_);
    for (int axis = 0; axis < 3; ++axis) job.layouts[axis] = layouts_->view(axis);
    job.step_mm = step_mm_;
    job.x0 = tile % view.tiles_x() * kTilePx;
    job.y0 = tile / view.tiles_x() * kTilePx;
    job.x1 = std::min(job.x0 + kTilePx, job.width);
    job.y1 = std::min(job.y0 + kTilePx, job.height);
    job.needed = only_needed && !view.needed.empty() ? view.needed.data() : nullptr;
    job.needed_stride = view.needed_stride;
    job.image = image;
    job.image_stride = stride;
    job.scratch = slot.cast_scratch.data();
    job.derivatives = derivatives;
    job.image_distance = static_cast<std::ptrdiff_t>(image_floats_);
    const bool joseph = render_.projector == Projector::joseph;
    if (derivatives) {
        (joseph ? kernels_.cast_joseph_derivatives : kernels_.cast_trilinear_derivatives)[layouts_->storage()](job);
    } else {
        (joseph ? kernels_.cast_joseph : kernels_.cast_trilinear)[layouts_->storage()](job);
    }
    if (std::isfinite(frame.ceiling)) saturate(job, static_cast<float>(frame.ceiling));
    slot.cast_s += seconds_since(start);
}

void CpuSession::sum_band(const Work& work, std::size_t frame, int band, const float* image, Slot& slot) {
    const auto start = Clock::now();
    const ViewPlan& view = views_[work.frames[frame].view];
    BandJob job{};
    job.image = image;
    job.image_distance = static_cast<std::ptrdiff_t>(image_floats_);
    job.scratch_distance = static_cast<std::ptrdiff_t>(band_scratch_floats(radius_));
    job.stride = view.stride;
    job.width = view.size_px.x();
    job.height = view.size_px.y();
    job.x0 = band % view.bands_x() * kBandColumns;
    job.x1 = std::min(job.x0 + kBandColumns, static_cast<int>(view.stride));
    job.y0 = band / view.bands_x() * view.band_rows();
    job.y1 = std::min(job.y0 + view.band_rows(), job.height);
    job.channels = channels_;
    job.radius = radius_;
    job.smooth = smooth_.data();
    job.derivative = derivative_.data();
    for (int channel = 0; channel < channels_; ++channel) job.fixed[channel] = view.fixed[channel].data();
    job.weights = view.weights.data();
    job.scratch = on_cache_line(slot.band_scratch.data());
    const std::size_t at = (frame * bands_ + band) * channels_;
    if (work.derivatives.empty()) {
        kernels_.sum_band(job, &partials_[at]);
    } else {
        kernels_.sum_band_derivatives(job, &derivative_partials_[at]);
    }
    slot.band_s += seconds_since(start);
}

void CpuSession::accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) {
    accumulate_all<MomentSums>({frames, {}}, sums);
}

void CpuSession::accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                            std::span<JacobianSums> sums) {
    std::vector<FrameDerivatives> floats;
    floats.reserve(derivatives.size());
    for (const RayFrameDerivatives& d : derivatives) floats.push_back(frame_derivatives(d));
    for (Slot& slot : slots_) slot.band_scratch.resize(derivative_scratch_floats(radius_) + kAlignFloats);
    accumulate_all<JacobianSums>({frames, floats, derivatives}, sums);
}

template <class Sums>
void CpuSession::accumulate_all(const Work& all, std::span<Sums> sums) {
    const std::span<const RayFrame> frames = all.frames;
    for (const RayFrame& frame : frames) make_layouts_for(frame);
    const auto start = Clock::now();
    const bool has_derivatives = !all.derivatives.empty();
    const std::size_t images = all.images_per_frame();
    // Of small images in large batches each thread takes a frame. Else they share its tiles, which balances better.
    const bool whole = !surface() && image_floats_ < std::size_t{128} * 129 &&
                       frames.size() >= 4 * static_cast<std::size_t>(workers_.threads());
    const std::size_t group =
        whole ? frames.size() : std::max<std::size_t>(1, kImagesInWork / (images * image_floats_));
    for (std::size_t begin = 0; begin < frames.size(); begin += group) {
        const std::size_t count = std::min(group, frames.size() - begin);
        Work work{frames.subspan(begin, count), {}};
        if (has_derivatives) work.derivatives = all.derivatives.subspan(begin, count);
        if (has_derivatives) work.of_surface = all.of_surface.subspan(begin, count);
        const std::size_t partials = count * bands_ * channels_;
        if (!has_derivatives && partials_.size() < partials) partials_.resize(partials);
        if (has_derivatives && derivative_partials_.size() < partials) derivative_partials_.resize(partials);
        whole ? whole_frames(work) : tiled_frames(work);
        add_partials(work, sums.subspan(begin * channels_));
    }
    share_time(seconds_since(start));
}

void CpuSession::whole_frames(const Work& work) {
    for (Slot& slot : slots_) slot.image.resize(std::max(slot.image.size(), work.images_per_frame() * image_floats_));
    workers_.run(work.frames.size(), [&](std::size_t i, int thread) {
        Slot& slot = slots_[thread];
        const RayFrame& frame = work.frames[i];
        const ViewPlan& view = views_[frame.view];
        for (int tile = 0; tile < view.tiles(); ++tile) {
            cast_tile(frame, work.derivatives_of(i), tile, slot.image.data(), view.stride, true, slot);
        }
        for (int band = 0; band < view.bands(); ++band) sum_band(work, i, band, slot.image.data(), slot);
    });
}

void CpuSession::tiled_frames(const Work& work) {
    const std::size_t frame_floats = work.images_per_frame() * image_floats_;
    if (images_.size() < work.frames.size() * frame_floats) images_.resize(work.frames.size() * frame_floats);
    int tiles = 0;
    for (const ViewPlan& view : views_) tiles = std::max(tiles, view.tiles());
    if (surface()) tiles = 0;
    workers_.run(work.frames.size() * tiles, [&](std::size_t turn, int thread) {
        const std::size_t i = turn / tiles;
        const int tile = static_cast<int>(turn % tiles);
        const ViewPlan& view = views_[work.frames[i].view];
        if (tile >= view.tiles()) return;
        cast_tile(work.frames[i], work.derivatives_of(i), tile, &images_[i * frame_floats], view.stride, true,
                  slots_[thread]);
    });
    if (surface()) draw_surfaces(work);
    workers_.run(work.frames.size() * bands_, [&](std::size_t turn, int thread) {
        const std::size_t i = turn / bands_;
        const int band = static_cast<int>(turn % bands_);
        if (band >= views_[work.frames[i].view].bands()) return;
        sum_band(work, i, band, &images_[i * frame_floats], slots_[thread]);
    });
}

void CpuSession::add_partials(const Work& work, std::span<MomentSums> sums) const {
    for (std::size_t i = 0; i < work.frames.size(); ++i) {
        const ViewPlan& view = views_[work.frames[i].view];
        for (int channel = 0; channel < channels_; ++channel) {
            MomentSums& sum = sums[i * channels_ + channel];
            sum = view.fixed_sums[channel];
            sum.moving = sum.moving_moving = sum.fixed_moving = 0;
            for (int band = 0; band < view.bands(); ++band) {
                const BandSums& partial = partials_[(i * bands_ + band) * channels_ + channel];
                sum.moving += partial.moving;
                sum.moving_moving += partial.moving_moving;
                sum.fixed_moving += partial.fixed_moving;
            }
        }
    }
}

void CpuSession::add_partials(const Work& work, std::span<JacobianSums> sums) const {
    for (std::size_t i = 0; i < work.frames.size(); ++i) {
        const ViewPlan& view = views_[work.frames[i].view];
        for (int channel = 0; channel < channels_; ++channel) {
            JacobianSums& sum = sums[i * channels_ + channel];
            sum = {};
            for (int band = 0; band < view.bands(); ++band) {
                sum += jacobian_sums_of(derivative_partials_[(i * bands_ + band) * channels_ + channel]);
            }
            sum.moments.weight = view.fixed_sums[channel].weight;
            sum.moments.fixed = view.fixed_sums[channel].fixed;
            sum.moments.fixed_fixed = view.fixed_sums[channel].fixed_fixed;
        }
    }
}

/// Filter and sums are one pass: with gc it counts as gradient, with ncc as reduction.
void CpuSession::share_time(double wall_s) {
    double cast_s = 0, band_s = 0;
    for (Slot& slot : slots_) {
        cast_s += std::exchange(slot.cast_s, 0);
        band_s += std::exchange(slot.band_s, 0);
    }
    if (!(cast_s + band_s > 0)) return;
    timing_.drr_s += wall_s * cast_s / (cast_s + band_s);
    (channels_ == 2 ? timing_.gradient_s : timing_.reduction_s) += wall_s * band_s / (cast_s + band_s);
}

}  // namespace raylign::detail::cpu
