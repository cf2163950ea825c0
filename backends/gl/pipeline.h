#pragma once

#include <functional>
#include <span>
#include <vector>

#include "backends/gl/chunks.h"
#include "backends/gl/device_scene.h"
#include "backends/gl/programs.h"
#include "core/surface/surface_drr.h"

namespace raylign::detail::gl {

struct PipelineOptions {
    Storage storage = Storage::int16;
    bool exact = false;          ///< interpolate from gathered texels instead of by the texture unit
    bool crop = false;           ///< keep only the box around the object
    double chunk_ms = 50;        ///< what one submission may take; tests make it small
    std::size_t work_bytes = 0;  ///< of frames in work at once; 0 = as fits the device
    bool descends = false;       ///< searches run on the device, by Descents
    int parts = 0;               ///< invocations that share a ray: 1, 2 or 4; 0 = as fits the device
};

/// A buffer that the device writes and the host reads after a fence: mapped for as long as it lives.
struct ReadBack {
    Buffer buffer;
    const std::byte* mapped = nullptr;
    std::size_t bytes = 0;

    void need(Context& context, std::string_view label, std::size_t count);
};

/// Draws the DRR of a frame on the host, and its derivatives unless they are null.
using HostDrawing = std::function<void(const RayFrame&, const RayFrameDerivatives*, const DrrTarget&)>;

/// A scene on the device, and the passes over it: cast (drr.comp), filter with the weighted sums of blocks of pixels
/// (sums.comp), totals (total.comp). Each frame is worked on alone and each sum added up in a fixed order, so that the
/// batch does not change a bit. The context must be current in all calls, the constructor and the destructor.
class Pipeline final : public DeviceScene {
public:
    using Options = PipelineOptions;

    Pipeline(DeviceScene scene, const PipelineOptions& options);
    /// From now on images come from the host, not from rays through the volume.
    void draw_by(HostDrawing drawing) { drawing_ = std::move(drawing); }

    /// Sums of all frames, [frame][channel][sum], valid until the next call. No derivatives: kMomentCount each.
    [[nodiscard]] std::span<const double> run(std::span<const RayFrame> frames,
                                              std::span<const RayFrameDerivatives> derivatives);
    [[nodiscard]] Image render(const RayFrame& frame);
    [[nodiscard]] DrrWithDerivatives render(const RayFrame& frame, const RayFrameDerivatives& derivatives);
    void upload_fixed();
    /// Since the last call; tells the context the rate of casting.
    [[nodiscard]] StageSeconds collect_times();

    /// True if searches may run on the device: rays are cast there, and no step takes long.
    [[nodiscard]] bool descends() const;

private:
    friend class Descents;

    /// One run: frames, and how many images and sums each has.
    struct Job {
        std::span<const RayFrame> frames;
        std::span<const RayFrameDerivatives> slopes = {};
        bool derivatives = false;
        std::size_t images_per_frame = 1, sums_per_frame = 0;
        bool sums = true;  ///< false: only images
        /// Where the device makes the frames: the work groups of each chunk's passes, nine words, and a place for sums
        /// that only the device reads. Null: as many as there are frames, sums for the host.
        const Buffer* groups = nullptr;
        const Buffer* device_sums = nullptr;
    };

    enum class Pass { cast, sums, total };  ///< as in write_groups of advance_frames.glsl
    struct Rows {
        int first, count;
    };

    void need_frames(std::size_t count, bool derivatives);
    void upload_frames(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives);
    void need_work(const Job& job, std::size_t frames);
    void need_sums(std::size_t count);
    [[nodiscard]] std::size_t bytes_per_frame(const Job& job) const;
    /// That there is memory for at once.
    [[nodiscard]] std::size_t most_frames(const Job& job) const;
    [[nodiscard]] std::vector<Chunk> chunks_of(const Job& job) const;
    void run_chunk(const Job& job, const Chunk& chunk);
    /// The images of the job's one frame.
    [[nodiscard]] std::vector<Image> cast_only(const Job& job);
    [[nodiscard]] std::vector<Image> read_images(std::size_t count, const Eigen::Vector2i& size_px);
    void compile(const Job& job);
    void cast(const Job& job, const Chunk& chunk);
    void upload_drawn(const Job& job, const Chunk& chunk);
    void cast_rows(const Job& job, const Chunk& chunk, const Rows& rows);
    void add_up(const Job& job, const Chunk& chunk);
    void total(const Job& job, const Chunk& chunk);
    /// The pass in use over the chunk's frames, `x` times `y` work groups each.
    void dispatch(const Job& job, const Chunk& chunk, Pass pass, GLuint x, GLuint y) const;
    void bind(const Job& job) const;
    void bind_work() const;  ///< what only the passes have
    [[nodiscard]] double samples(std::size_t view, bool derivatives) const;
    [[nodiscard]] double most_samples() const;  ///< of a view, with derivatives
    [[nodiscard]] double all_samples() const;   ///< of all views, with derivatives
    /// What of `data` tells how many work groups a pass has.
    void fill_groups(shared::DescentData& data) const;
    [[nodiscard]] ProgramSource cast_source(const Job& job) const;
    [[nodiscard]] ProgramSource sums_source(const Job& job) const;

    PipelineOptions options_;
    HostDrawing drawing_;                                ///< empty: rays are cast on the device
    std::vector<float> drawn_;                           ///< on the host
    Eigen::Vector2i most_px_ = Eigen::Vector2i::Zero();  ///< columns and rows of the widest and of the highest view
    std::size_t image_floats_ = 0, blocks_ = 0;          ///< the most that one view has
    Buffer fixed_images_;
    Buffer frames_, derivatives_, images_, partials_;
    std::size_t frames_capacity_ = 0, derivatives_capacity_ = 0, images_floats_ = 0, partials_count_ = 0;
    ReadBack sums_, images_read_;
    double cast_samples_ = 0;  ///< since times were collected
};

}  // namespace raylign::detail::gl
