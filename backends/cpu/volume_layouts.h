#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backends/cpu/brick_map.h"
#include "backends/cpu/kernel_types.h"
#include "backends/cpu/volume_copy.h"
#include "backends/cpu/workers.h"
#include "raylign/volume.h"

namespace raylign::detail::cpu {

/// The volume as planes across each axis (see PlaneLayout), and which parts of it are empty. One copy with neighbours
/// along x serves the axes y and z, one with neighbours along y serves the axis x (beyond 2^31 voxels, where 32 bits do
/// not reach from one z to another, z has a third). Each is made when a ray first needs it.
///
/// int16 voxels are multiples of a unit, max |attenuation| / 32767: off by half a unit at most, and 0 stays 0. So the
/// integral along L mm of volume is off by L max |attenuation| / 65534 at most.
class VolumeLayouts {
public:
    VolumeLayouts() = default;
    /// Makes the copy for `first_axis`; `source` holds floats and is read during this call only. Throws Error, before
    /// anything is allocated, where the memory that is free now cannot hold all copies.
    VolumeLayouts(const VoxelSource& source, const BrickMap& map, VoxelStorage storage, int first_axis,
                  Workers& workers);

    /// Makes the copy that `axis` needs, unless it is there.
    void make(int axis, Workers& workers);
    [[nodiscard]] bool has(int axis) const { return copies_[copy_of(axis)] != nullptr; }
    /// All zeros where has(axis) is false: no ray reads it.
    [[nodiscard]] PlaneLayout view(int axis) const;

    [[nodiscard]] VoxelStorage storage() const { return storage_; }
    /// Memory that copies and tables take.
    [[nodiscard]] std::size_t bytes() const;
    /// For people: storage, copies made, and the box of voxels that they hold.
    [[nodiscard]] std::string description() const;

private:
    [[nodiscard]] int copy_of(int axis) const;
    void make_from(const VoxelSource& source, int axis, Workers& workers);

    BrickMap map_{};
    VoxelStorage storage_ = kFloat32;
    float unit_per_mm_ = 1;
    std::unique_ptr<VolumeCopy> copies_[3];
    std::vector<std::int32_t> occupied_[3];  ///< PlaneLayout::occupied, by axis
};

/// Memory that all copies of a volume would take, pages of empty bricks included [bytes].
[[nodiscard]] double layout_bytes(const BrickMap& map, VoxelStorage storage);

/// How voxels are to be stored.
struct StorageRule {
    std::optional<VoxelStorage> wanted;  ///< none: `preferred`, but float32 only where all copies stay within max_bytes
    double max_bytes = 0;
    VoxelStorage preferred = kFloat32;
};
/// The rule looks at the volume alone, not at the memory that happens to be free: the same input gives the same bits.
[[nodiscard]] VoxelStorage choose_storage(const BrickMap& map, const StorageRule& rule);

/// The layouts of a volume, with the copy for `first_axis`.
[[nodiscard]] VolumeLayouts make_layouts(const Volume& volume, const StorageRule& rule, int first_axis,
                                         Workers& workers);

}  // namespace raylign::detail::cpu
