#pragma once

#include "core/io/dicom/dicom_tags.h"
#include "raylign/intensity.h"

namespace raylign::detail {

/// What the tags say of the pixels: PixelIntensityRelationship (0028,1040) and its sign (0028,1041), and the display
/// shutter (0018,1600 and following) and collimator (0018,1700 and following) as weights, 0 outside. Both count pixels
/// from 1, rows first. Shapes that are incomplete are left out. Source: DICOM PS3.3 C.7.6.11, C.8.7.3.
void take_dicom_intensity(const DicomTags& tags, RawXray& xray);

}  // namespace raylign::detail
