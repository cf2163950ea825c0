#pragma once

#include <memory>
#include <vector>

#include "backends/cpu/frame_plan.h"
#include "backends/cpu/kernel_types.h"
#include "backends/cpu/volume_layouts.h"
#include "backends/cpu/workers.h"
#include "core/backend.h"
#include "core/surface/surface_drr.h"

namespace raylign::detail::cpu {

/// A scene on the processor. Work is cut into tiles (cast) and bands (filter and sum) whose borders depend on
/// the image alone, and partial sums are added in order: the result has the same bits at any number of threads.
class CpuSession final : public Session {
public:
    CpuSession(const Scene& scene, const KernelTable& kernels, const StorageRule& storage, int threads);
    /// Other views of the volume of `resident`.
    CpuSession(const CpuSession& resident, std::span<const View> views, const Similarity& similarity);

    [[nodiscard]] std::size_t volume_bytes() const override;
    [[nodiscard]] std::string volume_layout() const override;
    [[nodiscard]] std::unique_ptr<Session> with_views(std::span<const View> views,
                                                      const Similarity& similarity) override;
    void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) override {
        workers_.run(count, [&turn](std::size_t i, int) { turn(i); });
    }

protected:
    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override;
    void accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                    std::span<JacobianSums> sums) override;
    Image render_frame(const RayFrame& frame) override;
    DrrWithDerivatives render_frame(const RayFrame& frame, const RayFrameDerivatives& derivatives) override;
    void weights_changed() override;

private:
    /// What one thread works in.
    struct Slot {
        PageBuffer cast_scratch;
        std::vector<float> image, band_scratch;
        double cast_s = 0, band_s = 0;
    };

    /// Frames in work at once. With derivatives, each has six more images behind its own.
    struct Work {
        std::span<const RayFrame> frames;
        std::span<const FrameDerivatives> derivatives;         ///< one per frame, or none
        std::span<const RayFrameDerivatives> of_surface = {};  ///< the same in double

        [[nodiscard]] std::size_t images_per_frame() const { return derivatives.empty() ? 1 : 1 + kParameters; }
        [[nodiscard]] const FrameDerivatives* derivatives_of(std::size_t frame) const {
            return derivatives.empty() ? nullptr : &derivatives[frame];
        }
    };

    void make_plans(std::span<const View> views, const Similarity& similarity);
    /// True where rays read the layout of their own dominant axis, not always that of axis 2.
    [[nodiscard]] bool all_axes() const;
    void make_layouts_for(const RayFrame& frame);
    /// Casts one tile; `derivatives` may be null.
    void cast_tile(const RayFrame& frame, const FrameDerivatives* derivatives, int tile, float* image,
                   std::ptrdiff_t stride, bool only_needed, Slot& slot);
    /// Draws all of the surface's DRR, on all threads.
    void draw_surface(const RayFrame& frame, const RayFrameDerivatives* derivatives, const DrrTarget& target);
    /// The same of all frames in work.
    void draw_surfaces(const Work& work);
    void sum_band(const Work& work, std::size_t frame, int band, const float* image, Slot& slot);
    void whole_frames(const Work& work);
    void tiled_frames(const Work& work);
    void add_partials(const Work& work, std::span<MomentSums> sums) const;
    void add_partials(const Work& work, std::span<JacobianSums> sums) const;
    template <class Sums>
    void accumulate_all(const Work& all, std::span<Sums> sums);
    void share_time(double wall_s);

    const KernelTable& kernels_;
    Workers workers_;
    VoxelGrid grid_;
    RenderSettings render_;
    double step_mm_;
    int channels_, radius_ = 0;
    std::vector<float> smooth_, derivative_;
    std::vector<ViewPlan> views_;
    std::shared_ptr<VolumeLayouts> layouts_;  ///< of all sessions on this volume; null where it has a surface
    unsigned axes_made_ = 0;                  ///< bit i: make_layouts_for has seen to axis i
    std::vector<Slot> slots_;
    std::vector<float> images_;       ///< of the frames in work, where several threads share one
    std::vector<BandSums> partials_;  ///< [frame][band][channel]
    std::vector<BandDerivativeSums> derivative_partials_;
    std::size_t image_floats_ = 0, bands_ = 0;  ///< the most that a view has
};

}  // namespace raylign::detail::cpu
