#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "backends/gl/context.h"
#include "core/base/for_each.h"
#include "raylign/backends.h"
#include "raylign/volume.h"

namespace raylign::detail::gl {

/// Texel t stands for attenuation scale_per_mm * (t - zero).
struct TexelScale {
    double scale_per_mm = 1, zero = 0;
};

/// The scale for values from `low` to `high` (0 is always among them), of which 0 is a multiple.
[[nodiscard]] TexelScale int16_scale(double low, double high);

/// Voxels [first, first + size) of a volume.
struct VoxelBox {
    Eigen::Vector3i first = Eigen::Vector3i::Zero(), size = Eigen::Vector3i::Zero();
};
/// The smallest box around all voxels that are not 0; one voxel where all are. Outside of it the field is 0, so that
/// cropping to it changes no DRR.
[[nodiscard]] VoxelBox object_box(const Volume& volume);

enum class Layout { layers_x, layers_y, layers_z, box };  ///< numbered as the texture units of shaders/volume.glsl

/// The volume on the device, in the layouts that rays have asked for so far. The context must be current in all calls.
class VolumeTextures {
public:
    /// Throws Error, kind unavailable, with size and limit where textures of the device are too small, and with the
    /// bytes where its memory is.
    VolumeTextures(Context& context, const Volume& volume, const VoxelBox& box, Storage storage, Layout first,
                   const ForEach& on_host);

    /// Makes a layout from one that is there.
    void need(Layout layout);
    [[nodiscard]] bool has(Layout layout) const { return static_cast<bool>(textures_[static_cast<int>(layout)]); }
    [[nodiscard]] GLuint id(Layout layout) const { return textures_[static_cast<int>(layout)].id(); }
    void bind() const;
    [[nodiscard]] std::size_t bytes() const;
    /// For people: "int16, layers across y, z".
    [[nodiscard]] std::string text() const;
    [[nodiscard]] const TexelScale& scale() const { return scale_; }
    [[nodiscard]] const VoxelBox& box() const { return box_; }

private:
    [[nodiscard]] Eigen::Vector3i texels(Layout layout) const;
    void allocate(Layout layout);
    template <class Texel, class Convert>
    void convert(const Volume& volume, Layout layout, int first, std::vector<Texel>& out, const ForEach& on_host,
                 const Convert& to_texel) const;
    void upload(const Volume& volume, Layout layout, const ForEach& on_host);
    void check_size(Layout layout) const;

    Context& context_;
    VoxelBox box_;
    Storage storage_;
    TexelScale scale_;
    std::array<Texture, 4> textures_;
};

}  // namespace raylign::detail::gl
