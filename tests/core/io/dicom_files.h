#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace raylign::detail::test {

/// A DICOM file of any kind, written element by element; tests change, add or erase elements.
struct DicomBuilder {
    std::map<std::uint32_t, std::pair<std::string, std::string>> tags;  ///< (group << 16) + element: VR, value
    std::string syntax = "1.2.840.10008.1.2.1";  ///< also implicit, big endian and deflated are written
    bool has_preamble = true, has_meta = true;
    std::vector<std::uint16_t> pixels;   ///< of 16 bits; written as bytes where BitsAllocated is 8
    std::vector<std::string> fragments;  ///< compressed pixels instead

    DicomBuilder& set(std::uint32_t tag, const std::string& vr, const std::string& value);
    DicomBuilder& us(std::uint32_t tag, std::uint16_t value);
    DicomBuilder& erase(std::uint32_t tag);
    [[nodiscard]] std::string bytes() const;
};

/// The bytes of a sequence of these items (the elements of each builder, without its pixels), explicit little endian.
[[nodiscard]] std::string sequence_of(const std::vector<DicomBuilder>& items);

/// A CT slice of 3 x 2 pixels of 0.5 x 0.75 mm at (10, 20, z_mm); all pixels are `hu` (stored + 1024).
[[nodiscard]] DicomBuilder ct_slice(double z_mm, int hu = 0);

/// An enhanced CT: a frame per entry of `z_mm`, with pixels of HU `hu`.
[[nodiscard]] DicomBuilder enhanced_ct(const std::vector<double>& z_mm, const std::vector<int>& hu);

}  // namespace raylign::detail::test
