#pragma once

#include <string>
#include <string_view>

#include "core/io/dicom/dicom_file.h"

namespace raylign::detail {

/// How compressed pixels are coded.
enum class PixelCodec { none, rle, jpeg, jpeg_ls, jpeg_2000 };
[[nodiscard]] PixelCodec pixel_codec(std::string_view syntax);

/// Throws Error for transfer syntaxes that are not read (video, JPEG XL, pixels kept elsewhere), naming those that are,
/// and for compressed pixels in one that has none, and the other way round.
void check_transfer_syntax(const DicomFile& file);

}  // namespace raylign::detail
