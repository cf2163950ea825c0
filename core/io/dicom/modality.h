#pragma once

#include <string>

#include "core/io/dicom/dicom_tags.h"

namespace raylign::detail {

/// SOPClassUID of the data set, else of the file's head (anonymisers empty the first); "" where neither says it.
[[nodiscard]] std::string sop_class_of(const DicomTags& tags);

/// Why the file is no CT (nor a volume that a C-arm reconstructed): what it is by its SOP class, and by Modality
/// (0008,0060) where no class is given; "" where it is one, or does not say.
[[nodiscard]] std::string why_no_ct(const DicomTags& tags, const std::string& where);

/// Throws Error, saying what the file is, for volumes, slices, ultrasound, endoscopy and what else is no X-ray image.
/// Secondary captures are taken: many fluoroscopes export nothing else.
void check_is_xray(const DicomTags& tags, const std::string& where);

/// A scout view that CT scanners put into the series: ImageType (0008,0008) has LOCALIZER.
[[nodiscard]] bool is_localizer(const DicomTags& tags);

/// CT, Enhanced CT, or a file cut off before it says what it is: such files must have pixels.
[[nodiscard]] bool must_have_pixels(const DicomTags& tags);

}  // namespace raylign::detail
