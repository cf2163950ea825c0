#pragma once

#include <string>

#include "core/io/dicom/dicom_tags.h"
#include "raylign/io/geometry.h"

namespace raylign::detail {

/// A portal image. The world's origin is the machine's isocentre, its axes are the patient's LPS. Angles as in IEC
/// 61217, degrees, right-handed about the axes x (to the right, seen from the couch's end), y (to the gantry), z (up):
/// GantryAngle about y (at 0 the source is above), PatientSupportAngle and TableTopEccentricAngle about z,
/// TableTopPitch and TableTopRollAngle about the table's x and y, XRayImageReceptorAngle about the gantry's z. The
/// collimator's angle (BeamLimitingDeviceAngle) does not move the image. PatientPosition says how the patient lies,
/// default HFS. RTImagePosition is the centre of the first pixel on the receptor (x to the right, y to the gantry), as
/// seen from the source; RTImageSID, ImagePlanePixelSpacing and XRayImageReceptorTranslation as DICOM PS3.3 C.8.8.2
/// defines them. Throws Error naming what is missing, and for tilted gantries, image planes that are not normal to the
/// beam, and rows or columns that are not in the receptor's plane.
[[nodiscard]] GeometryView read_rt_image(const DicomTags& tags, const GeometryHints& hints, const std::string& name,
                                         const std::string& where);

}  // namespace raylign::detail
