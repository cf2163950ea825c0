#include "core/io/dicom/dicom_writer.h"

#include "core/io/dicom/tag_numbers.h"
#include "core/io/dicom/value_representation.h"

namespace raylign::detail {
namespace {

std::string little_endian(std::uint64_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xff);
    return text;
}

std::string header(std::uint32_t tag, std::string_view vr, std::uint32_t length) {
    const std::string begin = little_endian(tag >> 16, 2) + little_endian(tag & 0xffff, 2) + std::string(vr);
    return has_long_length(vr) ? begin + std::string(2, '\0') + little_endian(length, 4)
                               : begin + little_endian(length, 2);
}

std::string item_header(std::uint32_t tag, std::uint32_t length) {
    return little_endian(tag >> 16, 2) + little_endian(tag & 0xffff, 2) + little_endian(length, 4);
}

}  // namespace

DicomWriter& DicomWriter::text(std::uint32_t tag, std::string_view vr, std::string value) {
    if (value.size() % 2 != 0) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
    data_ += header(tag, vr, static_cast<std::uint32_t>(value.size())) + value;
    return *this;
}

DicomWriter& DicomWriter::number(std::uint32_t tag, std::uint16_t value) {
    data_ += header(tag, "US", 2) + little_endian(value, 2);
    return *this;
}

DicomWriter& DicomWriter::sequence(std::uint32_t tag, const std::vector<DicomWriter>& items) {
    std::string content;
    for (const DicomWriter& item : items) {
        content += item_header(0xfffee000, static_cast<std::uint32_t>(item.data_.size())) + item.data_;
    }
    data_ += header(tag, "SQ", static_cast<std::uint32_t>(content.size())) + content;
    return *this;
}

DicomWriter& DicomWriter::append(const DicomWriter& more) {
    data_ += more.data_;
    return *this;
}

DicomWriter& DicomWriter::compressed_pixels(std::string_view stream) {
    std::string fragment(stream);
    if (fragment.size() % 2 != 0) fragment += '\0';
    data_ += header(tag::kPixelData, "OB", 0xffffffff) + item_header(0xfffee000, 0) +
             item_header(0xfffee000, static_cast<std::uint32_t>(fragment.size())) + fragment +
             item_header(0xfffee0dd, 0);
    return *this;
}

std::string DicomWriter::file(const std::string& sop_class, const std::string& sop_instance,
                              const std::string& syntax) const {
    DicomWriter meta;
    meta.text(0x00020001, "OB", std::string("\0\1", 2)).text(0x00020002, "UI", sop_class);
    meta.text(0x00020003, "UI", sop_instance).text(0x00020010, "UI", syntax);
    meta.text(0x00020012, "UI", "2.25.302044907817325091362205417253018812673").text(0x00020013, "SH", "RAYLIGN");
    const std::string length = header(0x00020000, "UL", 4) + little_endian(meta.data_.size(), 4);
    return std::string(128, '\0') + "DICM" + length + meta.data_ + data_;
}

}  // namespace raylign::detail
