#pragma once

#include <filesystem>
#include <string>

#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// World_from_ct of a DICOM Spatial Registration object of one rigid matrix beside the identity. DICOM's matrix maps
/// the frame of reference of its item to that of the object: the item is the CT, the object's frame the world. `ct`: a
/// DICOM file of the CT, or empty: where its frame of reference is known, it decides which of the two is the CT, and
/// the matrix is inverted where the object has it the other way round. Throws Error for other classes, matrices that
/// are not rigid, several registrations, and frames of reference none of which is the CT's.
[[nodiscard]] RigidTransform read_spatial_registration(const std::filesystem::path& path,
                                                       const std::filesystem::path& ct);

/// FrameOfReferenceUID (0020,0052) of a file; "" where it is no DICOM or does not say.
[[nodiscard]] std::string dicom_frame_of_reference(const std::filesystem::path& path);

/// Such an object: world_from_ct from the frame of reference of `ct` (a DICOM file), whose patient and study it gets,
/// to one made for this world. Numbers have up to 16 characters, as DICOM has them. Throws Error where the CT has no
/// FrameOfReferenceUID.
[[nodiscard]] std::string spatial_registration(const RigidTransform& world_from_ct, const std::filesystem::path& ct);

}  // namespace raylign::detail
