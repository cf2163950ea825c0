#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// A transform as a file of ITK states it.
struct StoredTransform {
    std::string type;  ///< such as "Euler3DTransform_double_3_3"
    std::vector<double> parameters, fixed_parameters;
};

/// The transforms of a text file ("#Insight Transform File V1.0") and of an HDF5 file, in their order. ITK's own
/// readers hand parameters on uncounted, and its transforms read beyond them. Throw Error for what is no such file.
[[nodiscard]] std::vector<StoredTransform> read_text_transforms(const std::filesystem::path& path);
[[nodiscard]] std::vector<StoredTransform> read_hdf5_transforms(const std::filesystem::path& path);

/// The rigid transform that they make together: several, or the parts of a CompositeTransform, are applied one after
/// the other, the last one first, as ITK does. Throws Error for a wrong number of parameters, and for a part that is
/// not rigid in 3-D, naming by how much it departs.
[[nodiscard]] RigidTransform rigid_from_transforms(const std::vector<StoredTransform>& transforms,
                                                   const std::string& where);

}  // namespace raylign::detail
