#include "dicom_files.h"

#include <zlib.h>

#include <algorithm>

#include "io_files.h"

namespace raylign::detail::test {
namespace {

constexpr const char* kImplicit = "1.2.840.10008.1.2";
constexpr const char* kBigEndian = "1.2.840.10008.1.2.2";
constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";

std::string swapped(std::string bytes, std::size_t width) {
    for (std::size_t at = 0; at + width <= bytes.size(); at += width) {
        std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                     bytes.begin() + static_cast<std::ptrdiff_t>(at + width));
    }
    return bytes;
}

std::size_t width_of(const std::string& vr) {
    if (vr == "US" || vr == "SS" || vr == "OW") return 2;
    if (vr == "UL" || vr == "SL" || vr == "FL") return 4;
    return vr == "FD" ? 8 : 1;
}

class ElementWriter {
public:
    explicit ElementWriter(const std::string& syntax)
        : is_implicit_(syntax == kImplicit), is_big_endian_(syntax == kBigEndian) {}

    [[nodiscard]] std::string number(std::uint32_t value, int bytes) const {
        std::string text = bytes == 2 ? bytes_of(static_cast<std::uint16_t>(value)) : bytes_of(value);
        return is_big_endian_ ? swapped(text, text.size()) : text;
    }

    [[nodiscard]] std::string element(std::uint32_t tag, const std::string& vr, std::string value) const {
        if (value.size() % 2 != 0) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
        if (is_big_endian_) value = swapped(value, width_of(vr));
        return header(tag, vr, static_cast<std::uint32_t>(value.size())) + value;
    }

    [[nodiscard]] std::string header(std::uint32_t tag, const std::string& vr, std::uint32_t length) const {
        const std::string begin = number(tag >> 16, 2) + number(tag & 0xffff, 2);
        if (is_implicit_) return begin + number(length, 4);
        const bool is_long = vr == "OB" || vr == "OW" || vr == "SQ" || vr == "UN";
        return begin + vr + (is_long ? std::string(2, '\0') + number(length, 4) : number(length, 2));
    }

private:
    bool is_implicit_, is_big_endian_;
};

std::string item_of(std::uint32_t tag, const std::string& content) {
    return bytes_of(static_cast<std::uint16_t>(tag >> 16)) + bytes_of(static_cast<std::uint16_t>(tag & 0xffff)) +
           bytes_of(static_cast<std::uint32_t>(content.size())) + content;
}

std::string deflated(const std::string& text) {
    z_stream stream{};
    deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY);
    std::string from = text, to(text.size() + 1000, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(from.data());
    stream.avail_in = static_cast<uInt>(from.size());
    stream.next_out = reinterpret_cast<Bytef*>(to.data());
    stream.avail_out = static_cast<uInt>(to.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    to.resize(stream.total_out);
    deflateEnd(&stream);
    return to;
}

std::string elements_of(const DicomBuilder& file, const ElementWriter& writer) {
    std::string data;
    for (const auto& [tag, value] : file.tags) data += writer.element(tag, value.first, value.second);
    return data;
}

std::string pixels_of(const DicomBuilder& file, const ElementWriter& writer) {
    if (!file.fragments.empty()) {
        std::string parts = item_of(0xfffee000, "");
        for (const std::string& fragment : file.fragments) {
            parts += item_of(0xfffee000, fragment.size() % 2 == 0 ? fragment : fragment + '\0');
        }
        return writer.header(0x7fe00010, "OB", 0xffffffff) + parts + item_of(0xfffee0dd, "");
    }
    if (file.pixels.empty()) return {};
    const auto allocated = file.tags.find(0x00280100);
    if (allocated == file.tags.end() || allocated->second.second != std::string("\x08\0", 2)) {
        return writer.element(0x7fe00010, "OW", bytes_of(file.pixels));
    }
    std::string bytes;
    for (const std::uint16_t pixel : file.pixels) bytes += static_cast<char>(pixel);
    return writer.element(0x7fe00010, "OW", bytes);
}

std::string numbers(const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : "\\") + std::to_string(value);
    return text;
}

}  // namespace

DicomBuilder& DicomBuilder::set(std::uint32_t tag, const std::string& vr, const std::string& value) {
    tags[tag] = {vr, value};
    return *this;
}

DicomBuilder& DicomBuilder::us(std::uint32_t tag, std::uint16_t value) { return set(tag, "US", bytes_of(value)); }

DicomBuilder& DicomBuilder::erase(std::uint32_t tag) {
    tags.erase(tag);
    return *this;
}

std::string DicomBuilder::bytes() const {
    const ElementWriter plain(""), writer(syntax);
    const auto stated = tags.find(0x00080016);
    const std::string sop_class = stated == tags.end() ? "1.2.840.10008.5.1.4.1.1.2" : stated->second.second;
    const std::string meta = plain.element(0x00020001, "OB", std::string("\0\1", 2)) +
                             plain.element(0x00020002, "UI", sop_class) + plain.element(0x00020003, "UI", "1.2.3.4") +
                             plain.element(0x00020010, "UI", syntax);
    const std::string data = elements_of(*this, writer) + pixels_of(*this, writer);
    std::string file = has_preamble ? std::string(128, '\0') + "DICM" : "";
    if (has_meta) file += plain.element(0x00020000, "UL", bytes_of(static_cast<std::uint32_t>(meta.size()))) + meta;
    return file + (syntax == kDeflated ? deflated(data) : data);
}

std::string sequence_of(const std::vector<DicomBuilder>& items) {
    std::string content;
    for (const DicomBuilder& item : items) content += item_of(0xfffee000, elements_of(item, ElementWriter("")));
    return content;
}

DicomBuilder ct_slice(double z_mm, int hu) {
    DicomBuilder slice;
    slice.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2").set(0x00080018, "UI", "1.2.3." + std::to_string(z_mm));
    slice.set(0x00080060, "CS", "CT").set(0x0020000e, "UI", "1.2.3").set(0x00200032, "DS", numbers({10, 20, z_mm}));
    slice.set(0x00200037, "DS", "1\\0\\0\\0\\1\\0").set(0x00280004, "CS", "MONOCHROME2");
    slice.us(0x00280002, 1).us(0x00280010, 2).us(0x00280011, 3).set(0x00280030, "DS", "0.75\\0.5");
    slice.us(0x00280100, 16).us(0x00280101, 12).us(0x00280102, 11).us(0x00280103, 0);
    slice.set(0x00281052, "DS", "-1024").set(0x00281053, "DS", "1").set(0x00281054, "LO", "HU");
    slice.pixels.assign(6, static_cast<std::uint16_t>(hu + 1024));
    return slice;
}

DicomBuilder enhanced_ct(const std::vector<double>& z_mm, const std::vector<int>& hu) {
    DicomBuilder file = ct_slice(0);
    file.pixels.clear();
    std::vector<DicomBuilder> frames;
    for (std::size_t i = 0; i < z_mm.size(); ++i) {
        DicomBuilder position, frame;
        position.set(0x00200032, "DS", numbers({10, 20, z_mm[i]}));
        frame.set(0x00209113, "SQ", sequence_of({position}));
        frames.push_back(frame);
        file.pixels.insert(file.pixels.end(), 6, static_cast<std::uint16_t>(hu[i] + 1024));
    }
    DicomBuilder orientation, measures, transformation, shared;
    orientation.set(0x00200037, "DS", "1\\0\\0\\0\\1\\0");
    measures.set(0x00280030, "DS", "0.75\\0.5");
    transformation.set(0x00281052, "DS", "-1024").set(0x00281053, "DS", "1").set(0x00281054, "LO", "HU");
    shared.set(0x00209116, "SQ", sequence_of({orientation})).set(0x00289110, "SQ", sequence_of({measures}));
    shared.set(0x00289145, "SQ", sequence_of({transformation}));
    for (const std::uint32_t tag : {0x00200032U, 0x00200037U, 0x00280030U, 0x00281052U, 0x00281053U, 0x00281054U}) {
        file.erase(tag);
    }
    file.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2.1");
    file.set(0x00280008, "IS", std::to_string(z_mm.size()));
    file.set(0x52009229, "SQ", sequence_of({shared})).set(0x52009230, "SQ", sequence_of(frames));
    return file;
}

}  // namespace raylign::detail::test
