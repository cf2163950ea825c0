#pragma once

#include <Eigen/Core>
#include <string>

#include "core/io/dicom/dicom_file.h"

namespace raylign::detail {

/// How the pixels of a DICOM file are stored, checked against what DICOM allows and against the bytes that are there.
struct PixelLayout {
    Eigen::Vector2i size = Eigen::Vector2i::Zero();  ///< columns, rows
    int frames = 1, samples = 1;
    int bits_allocated = 16, bits_stored = 16, high_bit = 15;
    bool is_signed = false;
    std::string photometric;

    [[nodiscard]] std::size_t frame_pixels() const {
        return static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    }
    [[nodiscard]] std::size_t frame_bytes() const {
        return frame_pixels() * static_cast<std::size_t>(samples) * static_cast<std::size_t>(bits_allocated / 8);
    }
    [[nodiscard]] double lowest() const;   ///< that can be stored
    [[nodiscard]] double highest() const;  ///< that can be stored
};

/// Throws Error with what, value, allowed range and file for numbers that no image has, photometric interpretations
/// that DICOM does not know, transfer syntaxes that are not read, and fewer pixels than the tags say.
[[nodiscard]] PixelLayout pixel_layout(const DicomFile& file);

/// Throws Error naming the tag in which the two differ. `name`, `other_name`: their files.
void check_same_layout(const PixelLayout& layout, const PixelLayout& other, const std::string& name,
                       const std::string& other_name);

}  // namespace raylign::detail
