#pragma once

#include <string>

#include "core/io/dicom/dicom_tags.h"
#include "raylign/io/geometry.h"

namespace raylign::detail {

/// A portal image. The world's origin is the machine's isocentre, its axes are LPS of a patient lying supine, head
/// first, on a couch at 0: at gantry 0 the source is anterior, a positive gantry angle moves it to the patient's left.
/// RTImagePosition is the centre of the first pixel on the receptor (x to the right, y to the gantry), as seen from the
/// source; RTImageSID, ImagePlanePixelSpacing and XRayImageReceptorTranslation as DICOM PS3.3 C.8.8.2 defines them.
/// Throws Error naming what is missing, and for turned couches, collimated receptors at an angle and rows or columns
/// that are not along the receptor's axes.
[[nodiscard]] GeometryView read_rt_image(const DicomTags& tags, const GeometryHints& hints, const std::string& name,
                                         const std::string& where);

}  // namespace raylign::detail
