#pragma once

#include <Eigen/Core>

#include "raylign/image.h"
#include "raylign/volume.h"

namespace raylign::detail {

// What an X-ray shows and the CT does not: for simulated X-rays that are harder than DRRs of the same volume.

/// A straight implant: all points within `radius_mm` of the segment.
struct Rod {
    Eigen::Vector3d begin_ct_mm, end_ct_mm;
    double radius_mm = 2.75;           ///< positive; default: a 5.5 mm spinal rod
    double attenuation_per_mm = 0.25;  ///< titanium at about 70 keV (4.5 g/cm^3 x 0.55 cm^2/g)
};

/// Puts the rod into the volume: each voxel becomes the mixture of what it was and the rod, by the share of its 4^3
/// samples that lie inside. Parts outside the grid are lost. Throws Error for a radius or attenuation that is not
/// positive or an end that is not finite.
void add_rod(Volume& volume, const Rod& rod);

/// Another beam than the CT's: multiplies attenuation below `bone_from_per_mm` by soft_gain and the part above it by
/// bone_gain (continuous). Throws Error for gains that are not positive.
struct TissueContrast {
    double bone_from_per_mm = 0.0237;  ///< 150 HU in the default preset
    double soft_gain = 1, bone_gain = 1;
};
void change_contrast(Volume& volume, const TissueContrast& contrast);

/// Adds scatter to a line-integral image: with the primary P = exp(-I) and S = ratio * (P smoothed by a Gaussian of
/// sigma_px), I' = -log((P + S) / (1 + ratio)); an unattenuated image stays as it is. Throws Error for a ratio outside
/// [0, 100] or a sigma that `smoothed` refuses.
[[nodiscard]] Image with_scatter(const Image& line_integral, double ratio, double sigma_px);

}  // namespace raylign::detail
