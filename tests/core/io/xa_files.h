#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace raylign::detail::test {

/// A DICOM X-ray of 16-bit pixels, by default a plausible XA image of 40 x 30 pixels; tests change, add or erase tags.
struct XaFile {
    std::map<std::uint32_t, std::pair<std::string, std::string>> tags;  ///< (group << 16) + element: VR, value
    int columns = 40, rows = 30, frames = 1;
    std::vector<std::uint16_t> pixels;  ///< empty = 1000 everywhere

    XaFile();
    XaFile& set(std::uint32_t tag, const std::string& vr, const std::string& value);
    XaFile& erase(std::uint32_t tag);
    [[nodiscard]] std::string bytes() const;
};

/// The same through ITK and GDCM, as other programs write it (single frame, text values only).
void write_with_gdcm(const std::filesystem::path& path, const XaFile& file);

}  // namespace raylign::detail::test
