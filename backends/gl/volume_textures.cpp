#include "backends/gl/volume_textures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "backends/gl/programs.h"
#include "core/base/error.h"

namespace raylign::detail::gl {
namespace {

constexpr std::size_t kUploadVoxels = std::size_t{1} << 22;  ///< converted at once: some MiB beside the volume
constexpr double kMostInt16 = 65535;
constexpr std::array<const char*, 4> kLabels = {"volume, layers across x", "volume, layers across y",
                                                "volume, layers across z", "volume"};

/// Axes of the volume along (column, row, layer) of a layout's texture.
std::array<int, 3> axes_of(Layout layout) {
    if (layout == Layout::layers_x) return {1, 2, 0};
    if (layout == Layout::layers_y) return {0, 2, 1};
    return {0, 1, 2};
}

std::string size_text(const Eigen::Vector3i& size) {
    return std::to_string(size.x()) + " x " + std::to_string(size.y()) + " x " + std::to_string(size.z());
}

/// A row of texels from voxels `stride` apart.
template <class Texel, class Convert>
void copy_row(const float* voxels, std::ptrdiff_t stride, int count, Texel* out, const Convert& convert) {
    if (stride == 1) {  // by itself, so that compilers make vectors of it
        for (int c = 0; c < count; ++c) out[c] = convert(voxels[c]);
    } else {
        for (int c = 0; c < count; ++c) out[c] = convert(voxels[c * stride]);
    }
}

/// The least and the greatest voxel.
std::pair<float, float> range_of(std::span<const float> voxels, const ForEach& on_host) {
    std::vector<std::pair<float, float>> parts((voxels.size() + kUploadVoxels - 1) / kUploadVoxels);
    on_host(parts.size(), [&](std::size_t i) {
        const std::span<const float> part = voxels.subspan(i * kUploadVoxels);
        const auto count = static_cast<Eigen::Index>(std::min(part.size(), kUploadVoxels));
        const Eigen::Map<const Eigen::ArrayXf> all(part.data(), count);
        parts[i] = {all.minCoeff(), all.maxCoeff()};
    });
    std::pair<float, float> range = parts.front();
    for (const auto& [low, high] : parts) range = {std::min(range.first, low), std::max(range.second, high)};
    return range;
}

GLenum target_of(Layout layout) { return layout == Layout::box ? GL_TEXTURE_3D : GL_TEXTURE_2D_ARRAY; }

}  // namespace

TexelScale int16_scale(double low, double high) {
    low = std::min(low, 0.0);
    high = std::max(high, 0.0);
    if (!(high - low > 0)) return {1, 0};
    // One unit more than needed below zero, so that rounding zero to a multiple cannot lose the lowest value.
    const double unit = low < 0 ? (high - low) / (kMostInt16 - 1) : (high - low) / kMostInt16;
    return {unit * kMostInt16, std::ceil(-low / unit) / kMostInt16};
}

VoxelBox object_box(const Volume& volume) {
    const Eigen::Vector3i size = volume.grid.size;
    Eigen::Vector3i low = size, high = Eigen::Vector3i::Constant(-1);
    for (int z = 0; z < size.z(); ++z) {
        for (int y = 0; y < size.y(); ++y) {
            const float* row = volume.attenuation_per_mm.data() + volume.index(0, y, z);
            const float* end = row + size.x();
            const float* first = std::find_if(row, end, [](float value) { return value != 0; });
            if (first == end) continue;
            const float* last = end;
            while (*(last - 1) == 0) --last;
            low = low.cwiseMin(Eigen::Vector3i(static_cast<int>(first - row), y, z));
            high = high.cwiseMax(Eigen::Vector3i(static_cast<int>(last - row) - 1, y, z));
        }
    }
    if (high.x() < 0) return {Eigen::Vector3i::Zero(), Eigen::Vector3i::Ones()};
    return {low, high - low + Eigen::Vector3i::Ones()};
}

VolumeTextures::VolumeTextures(Context& context, const Volume& volume, const VoxelBox& box, Storage storage,
                               Layout first, const ForEach& on_host)
    : context_(context), box_(box), storage_(storage) {
    if (storage_ == Storage::int16) {
        const auto [low, high] = range_of(volume.attenuation_per_mm, on_host);
        scale_ = int16_scale(low, high);
    }
    allocate(first);
    upload(volume, first, on_host);
}

Eigen::Vector3i VolumeTextures::texels(Layout layout) const {
    const std::array<int, 3> axes = axes_of(layout);
    return {box_.size[axes[0]], box_.size[axes[1]], box_.size[axes[2]]};
}

void VolumeTextures::check_size(Layout layout) const {
    const Limits& limits = context_.device().limits;
    const std::array<int, 3> axes = axes_of(layout);
    const bool box = layout == Layout::box;
    for (int i = 0; i < 3; ++i) {
        const int most = box ? limits.texture_3d : i < 2 ? limits.texture_2d : limits.texture_layers;
        if (box_.size[axes[i]] <= most) continue;
        throw Error("volume of " + size_text(box_.size) + " voxels: " + context_.device().renderer + " holds at most " +
                        std::to_string(most) + " along " + "xyz"[axes[i]] +
                        " of a texture (crop it to the object, or resample it)",
                    ErrorKind::unavailable);
    }
}

void VolumeTextures::allocate(Layout layout) {
    check_size(layout);
    const Gl& gl = context_.gl();
    const int unit = static_cast<int>(layout);
    const Eigen::Vector3i n = texels(layout);
    Texture texture = make_texture(gl, target_of(layout), kLabels[unit]);
    gl.TextureStorage3D(texture.id(), 1, storage_ == Storage::int16 ? GL_R16 : GL_R32F, n.x(), n.y(), n.z());
    if (!context_.memory_sufficed("allocating the volume")) {
        const std::size_t bytes =
            static_cast<std::size_t>(n.x()) * n.y() * n.z() * (storage_ == Storage::int16 ? 2 : 4);
        throw Error("volume of " + size_text(box_.size) + " voxels: " + context_.device().renderer +
                        " has no memory for a texture of " + std::to_string(bytes >> 20) +
                        " MiB (crop it to the object, or store it as int16)",
                    ErrorKind::unavailable);
    }
    // The border is attenuation 0: see volume.glsl.
    const auto zero = static_cast<float>(scale_.zero);
    const std::array<float, 4> border = {zero, zero, zero, zero};
    gl.TextureParameterfv(texture.id(), GL_TEXTURE_BORDER_COLOR, border.data());
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
        gl.TextureParameteri(texture.id(), wrap, GL_CLAMP_TO_BORDER);
    }
    gl.TextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl.TextureParameteri(texture.id(), GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    textures_[unit] = std::move(texture);
}

/// Texels of layers from `first` on, as many as fill `out`.
template <class Texel, class Convert>
void VolumeTextures::convert(const Volume& volume, Layout layout, int first, std::vector<Texel>& out,
                             const ForEach& on_host, const Convert& to_texel) const {
    const std::array<int, 3> axes = axes_of(layout);
    const Eigen::Vector3i n = texels(layout);
    const std::size_t layer_voxels = static_cast<std::size_t>(n.x()) * n.y();
    const std::ptrdiff_t stride = axes[0] == 0 ? 1 : volume.grid.size.x();  // columns are x or y
    on_host(out.size() / layer_voxels, [&](std::size_t l) {
        for (int r = 0; r < n.y(); ++r) {
            Eigen::Vector3i voxel = box_.first;
            voxel[axes[1]] += r;
            voxel[axes[2]] += first + static_cast<int>(l);
            const float* in = volume.attenuation_per_mm.data() + volume.index(voxel.x(), voxel.y(), voxel.z());
            copy_row(in, stride, n.x(), &out[l * layer_voxels + static_cast<std::size_t>(r) * n.x()], to_texel);
        }
    });
}

void VolumeTextures::upload(const Volume& volume, Layout layout, const ForEach& on_host) {
    const Gl& gl = context_.gl();
    const Eigen::Vector3i n = texels(layout);
    const std::size_t layer_voxels = static_cast<std::size_t>(n.x()) * n.y();
    const int slab = static_cast<int>(std::clamp<std::size_t>(kUploadVoxels / layer_voxels, 1, n.z()));
    std::vector<float> floats;
    std::vector<std::uint16_t> ints;
    const double per_unit = kMostInt16 / scale_.scale_per_mm, offset = kMostInt16 * scale_.zero + 0.5;
    const auto to_int = [=](float voxel) {  // by way of int: one instruction takes several
        return static_cast<std::uint16_t>(static_cast<int>(voxel * per_unit + offset));
    };
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    for (int first = 0; first < n.z(); first += slab) {
        const int layers = std::min(slab, n.z() - first);
        const std::size_t voxels = layer_voxels * static_cast<std::size_t>(layers);
        const bool as_ints = storage_ == Storage::int16;
        if (as_ints) {
            ints.resize(voxels);
            convert(volume, layout, first, ints, on_host, to_int);
        } else {
            floats.resize(voxels);
            convert(volume, layout, first, floats, on_host, [](float voxel) { return voxel; });
        }
        gl.TextureSubImage3D(textures_[static_cast<int>(layout)].id(), 0, 0, 0, first, n.x(), n.y(), layers, GL_RED,
                             as_ints ? GL_UNSIGNED_SHORT : GL_FLOAT,
                             as_ints ? static_cast<const void*>(ints.data()) : floats.data());
    }
    context_.check("uploading the volume");  // drivers may find out only now that memory is short
}

void VolumeTextures::need(Layout layout) {
    if (has(layout)) return;
    const auto from = static_cast<Layout>(std::ranges::find_if(textures_, [](const Texture& t) { return bool(t); }) -
                                          textures_.begin());
    allocate(layout);
    const Gl& gl = context_.gl();
    const Eigen::Vector3i n = texels(layout);
    if (layout == Layout::box) {
        need(Layout::layers_z);
        gl.CopyImageSubData(id(Layout::layers_z), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, id(layout), GL_TEXTURE_3D, 0, 0, 0,
                            0, n.x(), n.y(), n.z());
        context_.check("copying the volume");
        return;
    }
    const bool from_box = from == Layout::box;
    const GLuint relayout = program(context_, {{"relayout.comp"},
                                               {{"FROM_BOX", from_box},
                                                {"INT16", storage_ == Storage::int16},
                                                {"FROM_AXIS", from_box ? 2 : static_cast<int>(from)},
                                                {"TO_AXIS", static_cast<int>(layout)}}});
    gl.UseProgram(relayout);
    gl.BindTextureUnit(0, id(from));
    gl.BindImageTexture(0, id(layout), 0, GL_TRUE, 0, GL_WRITE_ONLY, storage_ == Storage::int16 ? GL_R16 : GL_R32F);
    gl.DispatchCompute((n.x() + 7) / 8, (n.y() + 7) / 8, n.z());
    gl.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT);  // read by shaders and copies
    context_.check("laying out the volume");
}

void VolumeTextures::bind() const {
    for (GLuint unit = 0; unit < textures_.size(); ++unit) context_.gl().BindTextureUnit(unit, textures_[unit].id());
}

std::string VolumeTextures::text() const {
    std::string layers;
    for (int axis = 0; axis < 3; ++axis) {
        if (textures_[axis]) layers += (layers.empty() ? ", layers across " : ", ") + std::string(1, "xyz"[axis]);
    }
    const std::string storage = storage_ == Storage::int16 ? "int16" : "float32";
    return storage + layers + (has(Layout::box) ? ", 3-D texture" : "");
}

std::size_t VolumeTextures::bytes() const {
    const std::size_t voxels = static_cast<std::size_t>(box_.size.x()) * box_.size.y() * box_.size.z();
    const auto made =
        static_cast<std::size_t>(std::ranges::count_if(textures_, [](const Texture& t) { return bool(t); }));
    return made * voxels * (storage_ == Storage::int16 ? 2 : 4);
}

}  // namespace raylign::detail::gl
