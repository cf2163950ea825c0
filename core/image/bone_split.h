#pragma once

#include <string>
#include <vector>

#include "raylign/volume.h"

namespace raylign::detail {

/// How bone is told apart where no label map is.
struct BoneSplitOptions {
    float above_per_mm = 0;   ///< attenuation that bone exceeds
    double opening_mm = 2;    ///< what is thinner than twice this does not hold two bones together
    double least_mm3 = 3000;  ///< smaller pieces are none
    double hole_mm2 = 1500;   ///< in axial slices marrow of up to this is filled; the hole of a pelvis is larger
};

/// A piece, called by where it lies: "left", "right" or "middle" of all bone, and its number there from the head.
struct SplitBone {
    std::string name;
    std::int32_t label = 0;
    double volume_mm3 = 0;
};
struct BoneSplit {
    LabelMap map;  ///< on the volume's grid
    std::vector<SplitBone> bones;
};

/// Splits a CT into connected bones: threshold, marrow filled, opening (erosion by a box, whose connected pieces grow
/// back through the bone around them, each voxel to the piece that reaches it first), pieces that are large enough.
/// Simple: bones that have grown together stay one, and thin ones may fall apart. It serves to tell hip bones, femurs
/// or a forearm apart for registration, and is no segmentation for diagnosis. Throws Error where no piece is left.
[[nodiscard]] BoneSplit split_bones(const Volume& ct, const BoneSplitOptions& options);

}  // namespace raylign::detail
