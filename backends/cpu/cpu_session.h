#pragma once

#include <memory>
#include <vector>

#include "backends/cpu/frame_plan.h"
#include "backends/cpu/kernel_types.h"
#include "backends/cpu/volume_layout.h"
#include "backends/cpu/workers.h"
#include "core/backend.h"

namespace raylign::cpu {

/// A scene on the processor. Work is cut into tiles (cast) and bands of rows (filter and sum) whose borders depend on
/// the image alone, and partial sums are added in order: the result has the same bits at any number of threads.
class CpuSession final : public Session {
public:
    CpuSession(const Scene& scene, const KernelTable& kernels, VoxelStorage storage, int threads);

    [[nodiscard]] std::size_t volume_bytes() const override;

protected:
    using Session::accumulate;
    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override;
    Image render_frame(const RayFrame& frame) override;

private:
    /// What one thread works in.
    struct Slot {
        PageBuffer cast_scratch;
        std::vector<float> image, band_scratch;
        double cast_s = 0, band_s = 0;
    };

    void make_layout(int axis);
    void make_layouts_for(const RayFrame& frame);
    void cast_tile(const RayFrame& frame, int tile, float* image, std::ptrdiff_t stride, bool only_needed, Slot& slot);
    void sum_band(const RayFrame& frame, int band, const float* image, BandSums* partial, Slot& slot);
    void whole_frames(std::span<const RayFrame> frames);
    void tiled_frames(std::span<const RayFrame> frames);
    void add_partials(std::span<const RayFrame> frames, std::span<MomentSums> sums) const;
    void share_time(double wall_s);

    const KernelTable& kernels_;
    VoxelStorage storage_;
    Workers workers_;
    VoxelGrid grid_;
    RenderSettings render_;
    double step_mm_;
    int channels_, radius_ = 0;
    std::vector<float> smooth_, derivative_;
    std::vector<ViewPlan> views_;
    std::unique_ptr<VolumeLayout> layouts_[3];
    std::vector<Slot> slots_;
    std::vector<float> images_;                 ///< of the frames in work, where several threads share one
    std::vector<BandSums> partials_;            ///< [frame][band][channel]
    std::size_t image_floats_ = 0, bands_ = 0;  ///< the most that a view has
};

}  // namespace raylign::cpu
