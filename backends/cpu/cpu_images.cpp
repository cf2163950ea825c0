// What CpuSession draws itself, not summed: DRRs for people, and those of surfaces.

#include <algorithm>

#include "backends/cpu/cpu_session.h"
#include "core/base/clock.h"

namespace raylign::detail::cpu {

std::size_t CpuSession::volume_bytes() const { return surface() ? surface()->bytes() : layouts_->bytes(); }
std::string CpuSession::volume_layout() const { return surface() ? surface()->description() : layouts_->description(); }

void CpuSession::draw_surface(const RayFrame& frame, const RayFrameDerivatives* derivatives, const DrrTarget& target) {
    const SurfaceProjection seen = surface()->project(frame, views_[frame.view].size_px);
    workers_.run(seen.bands.size(), [&](std::size_t band, int thread) {
        const auto start = Clock::now();
        surface()->draw(seen, frame, derivatives, band, target);
        slots_[thread].cast_s += seconds_since(start);
    });
}

void CpuSession::draw_surfaces(const Work& work) {
    const auto distance = static_cast<std::ptrdiff_t>(image_floats_);
    for (std::size_t i = 0; i < work.frames.size(); ++i) {
        const RayFrame& frame = work.frames[i];
        const DrrTarget target{&images_[i * work.images_per_frame() * image_floats_], views_[frame.view].stride,
                               distance};
        draw_surface(frame, work.of_surface.empty() ? nullptr : &work.of_surface[i], target);
    }
}

Image CpuSession::render_frame(const RayFrame& frame) {
    make_layouts_for(frame);
    const auto start = Clock::now();
    const ViewPlan& view = views_[frame.view];
    Image drr(view.size_px.x(), view.size_px.y());
    if (surface()) draw_surface(frame, nullptr, {drr.pixels.data(), drr.width, 0});
    workers_.run(surface() ? 0 : view.tiles(), [&](std::size_t tile, int thread) {
        cast_tile(frame, nullptr, static_cast<int>(tile), drr.pixels.data(), drr.width, false, slots_[thread]);
    });
    share_time(seconds_since(start));
    return drr;
}

DrrWithDerivatives CpuSession::render_frame(const RayFrame& frame, const RayFrameDerivatives& derivatives) {
    make_layouts_for(frame);
    const auto start = Clock::now();
    const ViewPlan& view = views_[frame.view];
    const FrameDerivatives floats = frame_derivatives(derivatives);
    images_.resize(std::max(images_.size(), (1 + kParameters) * image_floats_));
    if (surface()) {
        draw_surface(frame, &derivatives, {images_.data(), view.stride, static_cast<std::ptrdiff_t>(image_floats_)});
    }
    workers_.run(surface() ? 0 : view.tiles(), [&](std::size_t tile, int thread) {
        cast_tile(frame, &floats, static_cast<int>(tile), images_.data(), view.stride, false, slots_[thread]);
    });
    const auto image = [&](int i) {
        Image out(view.size_px.x(), view.size_px.y());
        const float* row = images_.data() + i * image_floats_;
        for (int y = 0; y < out.height; ++y, row += view.stride) {
            std::copy_n(row, out.width, out.pixels.begin() + static_cast<std::ptrdiff_t>(y) * out.width);
        }
        return out;
    };
    DrrWithDerivatives drr{image(0), {}};
    for (int i = 0; i < kParameters; ++i) drr.derivatives[i] = image(1 + i);
    share_time(seconds_since(start));
    return drr;
}

}  // namespace raylign::detail::cpu
