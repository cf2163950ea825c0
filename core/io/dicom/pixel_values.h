#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/io/dicom/pixel_layout.h"

namespace raylign::detail {

/// Modality LUT (0028,3000): stored values to others; beyond its ends the nearest entry counts.
struct ModalityLut {
    double first = 0;  ///< stored value of entries[0]
    std::vector<std::uint16_t> entries;
    std::string type;  ///< ModalityLUTType (0028,3004), such as OD or US
    [[nodiscard]] double operator()(double stored) const;
};

/// What stored values stand for, of one frame.
struct PixelValues {
    double slope = 1, intercept = 0;
    bool is_stated = false;  ///< RescaleSlope and RescaleIntercept are there
    std::string unit;        ///< RescaleType (0028,1054), such as HU; "" = not said
    std::optional<ModalityLut> lut;

    [[nodiscard]] bool is_identity() const { return slope == 1 && intercept == 0 && !lut; }
    [[nodiscard]] double operator()(double stored) const { return lut ? (*lut)(stored) : slope * stored + intercept; }
};

/// By the tags of the frame (tags_of_frame). Throws Error with what, value, allowed and file for a slope of 0, numbers
/// that are none, one of the two alone, tables that do not fit what they say, and a table beside another slope than 1.
[[nodiscard]] PixelValues pixel_values(const DicomTags& tags, const PixelLayout& layout, bool is_big_endian,
                                       const std::string& where);

/// Stored values that are no image: PixelPaddingValue (0028,0120) to PixelPaddingRangeLimit (0028,0121).
struct PaddingRange {
    double lowest = 0, highest = 0;
};
[[nodiscard]] std::optional<PaddingRange> padding_range(const DicomTags& tags, const PixelLayout& layout,
                                                        const std::string& where);

/// Stored values of one frame's words (BitsAllocated each), and which of them are padding.
struct StoredFrame {
    std::vector<double> values;
    std::vector<bool> is_padding;  ///< empty: none
};
/// Throws Error for a word with bits beyond HighBit, unless overlays lie there or it is padding.
[[nodiscard]] StoredFrame stored_frame(const std::string& bytes, const PixelLayout& layout,
                                       const std::optional<PaddingRange>& padding, bool has_overlay_bits,
                                       const std::string& where);

}  // namespace raylign::detail
