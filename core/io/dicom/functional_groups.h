#pragma once

#include <string>

#include "core/io/dicom/dicom_tags.h"

namespace raylign::detail {

/// Whether each frame has its own data, in Per-frame Functional Groups (5200,9230).
[[nodiscard]] bool has_functional_groups(const DicomTags& tags);

/// The data of one frame, from 0: those of the file, over them those of its shared and its per-frame functional groups.
/// Throws Error, naming the file, where the frame has none.
[[nodiscard]] DicomTags tags_of_frame(const DicomTags& tags, int frame, const std::string& where);

}  // namespace raylign::detail
