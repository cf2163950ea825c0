#pragma once

#include <vector>

#include "backends/gl/context.h"
#include "backends/gl/shared.h"
#include "backends/gl/volume_textures.h"
#include "core/backend.h"

namespace raylign::detail::gl {

inline constexpr int kMostRadius_px = 64;                       ///< of a filter
inline constexpr int kMostTaps = 2 * kMostRadius_px + 1 + 7;    ///< with the zeros that strips of eight pixels need
inline constexpr int kBlockColumns_px = 16, kBlockRows_px = 8;  ///< whose sums are added up at once (sums.comp)

/// As in shaders/buffers.glsl.
enum UniformBinding : GLuint { kSceneBinding, kTapsBinding };
enum StorageBinding : GLuint {
    kFrameBinding,
    kDerivativeBinding,
    kViewBinding,
    kImageBinding,
    kFixedBinding,
    kPartialBinding,
    kSumBinding
};

/// What shaders know of a scene and does not change: sizes, filter taps, views.
struct SceneBuffers {
    Buffer scene, taps, views;
};
/// What they are made from: a Scene without voxels.
struct ViewScene {
    const VoxelGrid& grid;
    std::span<const View> views;
    RenderSettings render;
    Similarity similarity;
};
[[nodiscard]] SceneBuffers make_scene_buffers(Context& context, const ViewScene& scene, const VolumeTextures& volume);
void bind(const Gl& gl, const SceneBuffers& buffers);

/// Work groups of `size` that cover `count`.
[[nodiscard]] constexpr GLuint work_groups(int count, int size) {
    return static_cast<GLuint>((count + size - 1) / size);
}
/// Blocks of pixels that an image's sums are taken of.
[[nodiscard]] inline GLuint blocks_of(const Eigen::Vector2i& size_px) {
    return work_groups(size_px.x(), kBlockColumns_px) * work_groups(size_px.y(), kBlockRows_px);
}

/// A buffer that the host may write to by commands, or with the given flags; 0 leaves it to the device alone. Throws
/// Error, kind unavailable, with its size where memory does not suffice.
[[nodiscard]] Buffer make_storage(Context& context, std::string_view label, std::size_t bytes,
                                  GLbitfield flags = GL_DYNAMIC_STORAGE_BIT);

/// The define FILTER_BITS of volume.glsl.
[[nodiscard]] inline int emulated_bits(const Context& context) {
    return context.device().emulates_filter() ? context.device().filter_bits : 0;
}

/// Sums of the fixed channels alone, [view][channel], in double on the host; those with the moving image are 0.
[[nodiscard]] std::vector<MomentSums> fixed_sums(const std::vector<FixedChannels>& fixed);

/// The layout of the volume that the scene's first view asks for.
[[nodiscard]] Layout first_layout(const Scene& scene, bool exact);
/// What of the volume goes to the device.
[[nodiscard]] VoxelBox box_of(const Scene& scene, bool crop);

}  // namespace raylign::detail::gl
