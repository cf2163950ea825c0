#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/io/images/png.h"
#include "raylign/image.h"

namespace raylign::detail {

/// What a Secondary Capture tells beside its pixels. Texts are ASCII.
struct CaptureTexts {
    std::string series;       ///< description of the series
    std::string derivation;   ///< how the picture came about
    std::string comment;      ///< for whoever looks at it
    std::string series_seed;  ///< the same text gives the same series
    int instance = 1;         ///< number in the series
};

/// The first of the files that is DICOM and says its study; "" where none does.
[[nodiscard]] std::filesystem::path dicom_study_file(const std::vector<std::filesystem::path>& files);

/// A DICOM Secondary Capture (PS3.3, A.8.1) of a picture, 8 bit RGB. `source`: a DICOM file whose patient and study it
/// gets and which it names as its source, or "": a study of its own, of no patient. UIDs are made of the texts, the
/// study and the pixels: the same picture of the same study is the same instance.
[[nodiscard]] std::string secondary_capture(const CaptureTexts& texts, const RgbImage& picture,
                                            const std::filesystem::path& source);

/// The same of line integrals, 16 bit grey, denser = brighter; RescaleSlope and RescaleIntercept give them back. Pixels
/// that are not finite are as the least.
[[nodiscard]] std::string secondary_capture(const CaptureTexts& texts, const Image& line_integrals,
                                            const std::filesystem::path& source);

}  // namespace raylign::detail
