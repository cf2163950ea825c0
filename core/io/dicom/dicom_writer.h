#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace raylign::detail {

/// Bytes of a data set in explicit little endian. Elements must come in the order of their tags.
class DicomWriter {
public:
    DicomWriter& text(std::uint32_t tag, std::string_view vr, std::string value);
    DicomWriter& number(std::uint32_t tag, std::uint16_t value);  ///< US
    DicomWriter& sequence(std::uint32_t tag, const std::vector<DicomWriter>& items);
    /// The elements of another data set.
    DicomWriter& append(const DicomWriter& more);
    /// Compressed pixels: one fragment.
    DicomWriter& compressed_pixels(std::string_view stream);

    [[nodiscard]] const std::string& data() const { return data_; }
    /// A file of this data set: preamble, group 2, data.
    [[nodiscard]] std::string file(const std::string& sop_class, const std::string& sop_instance,
                                   const std::string& syntax) const;

private:
    std::string data_;
};

}  // namespace raylign::detail
