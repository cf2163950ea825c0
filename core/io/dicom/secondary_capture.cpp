#include "core/io/dicom/secondary_capture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/io/dicom/dicom_file.h"
#include "core/io/dicom/dicom_values.h"
#include "core/io/dicom/dicom_writer.h"
#include "core/io/dicom/modality.h"
#include "core/io/dicom/tag_numbers.h"
#include "raylign/version.h"

namespace raylign::detail {
namespace {

constexpr const char* kCaptureClass = "1.2.840.10008.5.1.4.1.1.7";
constexpr double kMostLevel = 65535;

/// Pixels, and the elements of group 0028 that describe them.
struct CapturedPixels {
    DicomWriter description;
    const char* vr = "";
    std::string bytes;
};

void describe_size(DicomWriter& writer, int width, int height) {
    writer.number(tag::kRows, static_cast<std::uint16_t>(height));
    writer.number(tag::kColumns, static_cast<std::uint16_t>(width));
}

void describe_bits(DicomWriter& writer, std::uint16_t bits) {
    writer.number(tag::kBitsAllocated, bits).number(tag::kBitsStored, bits);
    writer.number(tag::kHighBit, static_cast<std::uint16_t>(bits - 1)).number(tag::kRepresentation, 0);
    writer.text(0x00280301, "CS", "NO");  // nothing burned in tells the patient
}

CapturedPixels captured(const RgbImage& picture) {
    CapturedPixels pixels;
    pixels.vr = "OB";
    pixels.description.number(tag::kSamples, 3).text(tag::kPhotometric, "CS", "RGB").number(0x00280006, 0);
    describe_size(pixels.description, picture.width, picture.height);
    describe_bits(pixels.description, 8);
    for (const auto& pixel : picture.pixels) pixels.bytes.append(pixel.begin(), pixel.end());
    return pixels;
}

CapturedPixels captured(const Image& image) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const float value : image.pixels) {
        if (!std::isfinite(value)) continue;
        low = std::min<double>(low, value);
        high = std::max<double>(high, value);
    }
    if (!(low <= high)) low = high = 0;
    const double slope = high > low ? (high - low) / kMostLevel : 1;
    CapturedPixels pixels;
    pixels.vr = "OW";
    pixels.description.number(tag::kSamples, 1).text(tag::kPhotometric, "CS", "MONOCHROME2");
    describe_size(pixels.description, image.width, image.height);
    describe_bits(pixels.description, 16);
    pixels.description.text(tag::kWindow, "DS", decimal_string((low + high) / 2));
    pixels.description.text(0x00281051, "DS", decimal_string(std::max(high - low, slope)));
    pixels.description.text(tag::kIntercept, "DS", decimal_string(low)).text(tag::kSlope, "DS", decimal_string(slope));
    pixels.description.text(tag::kRescaleType, "LO", "US");
    for (const float value : image.pixels) {
        const double level = std::isfinite(value) ? std::clamp((value - low) / slope, 0.0, kMostLevel) : 0;
        const auto stored = static_cast<unsigned>(std::lround(level));
        pixels.bytes += static_cast<char>(stored & 255);
        pixels.bytes += static_cast<char>(stored >> 8);
    }
    return pixels;
}

void copy(DicomWriter& writer, const DicomTags& tags, std::uint32_t tag, const char* vr) {
    writer.text(tag, vr, tags.text(tag));
}

/// Group 0008: who, when and how.
void describe_origin(DicomWriter& writer, const DicomTags& tags, const CaptureTexts& texts,
                     const std::string& instance) {
    copy(writer, tags, 0x00080005, "CS");  // the character set of what is copied
    writer.text(tag::kImageType, "CS", "DERIVED\\SECONDARY").text(tag::kClass, "UI", kCaptureClass);
    writer.text(0x00080018, "UI", instance);
    copy(writer, tags, 0x00080020, "DA");
    writer.text(0x00080023, "DA", utc_now("%Y%m%d"));
    copy(writer, tags, 0x00080030, "TM");
    writer.text(0x00080033, "TM", utc_now("%H%M%S"));
    copy(writer, tags, 0x00080050, "SH");
    writer.text(tag::kModality, "CS", "OT").text(0x00080064, "CS", "WSD").text(0x00080070, "LO", "raylign");
    copy(writer, tags, 0x00080090, "PN");
    copy(writer, tags, 0x00081030, "LO");
    writer.text(tag::kSeriesDescription, "LO", texts.series).text(0x00082111, "ST", texts.derivation);
    if (tags.text(0x00080018).empty()) return;
    DicomWriter source;
    source.text(0x00081150, "UI", sop_class_of(tags)).text(0x00081155, "UI", tags.text(0x00080018));
    writer.sequence(0x00082112, {source});
}

std::string capture_file(const CaptureTexts& texts, const CapturedPixels& pixels, const std::filesystem::path& source) {
    const DicomTags tags = source.empty() ? DicomTags() : open_dicom(source).tags;
    const std::string known = tags.text(tag::kStudyUid);
    const std::string study = known.empty() ? uid_of("study " + texts.series_seed) : known;
    const std::string series = uid_of("series " + study + " " + texts.series_seed);
    const std::string instance = uid_of(series + " " + std::to_string(texts.instance) + " " + pixels.bytes);
    DicomWriter writer;
    describe_origin(writer, tags, texts, instance);
    copy(writer, tags, 0x00100010, "PN");
    copy(writer, tags, 0x00100020, "LO");
    copy(writer, tags, 0x00100030, "DA");
    copy(writer, tags, 0x00100040, "CS");
    writer.text(0x00181016, "LO", "raylign").text(0x00181019, "LO", RAYLIGN_VERSION);
    writer.text(tag::kStudyUid, "UI", study).text(tag::kSeriesUid, "UI", series);
    copy(writer, tags, 0x00200010, "SH");
    writer.text(tag::kSeriesNumber, "IS", "").text(0x00200013, "IS", std::to_string(texts.instance));
    writer.text(0x00200020, "CS", "").text(0x00204000, "LT", texts.comment);
    writer.append(pixels.description).text(tag::kPixelData, pixels.vr, pixels.bytes);
    return writer.file(kCaptureClass, instance, "1.2.840.10008.1.2.1");
}

}  // namespace

std::filesystem::path dicom_study_file(const std::vector<std::filesystem::path>& files) {
    for (const std::filesystem::path& file : files) {
        if (file.empty()) continue;
        const std::optional<DicomTags> tags = read_dicom_tags(file);
        if (tags && !tags->text(tag::kStudyUid).empty()) return file;
    }
    return {};
}

std::string secondary_capture(const CaptureTexts& texts, const RgbImage& picture, const std::filesystem::path& source) {
    return capture_file(texts, captured(picture), source);
}

std::string secondary_capture(const CaptureTexts& texts, const Image& line_integrals,
                              const std::filesystem::path& source) {
    return capture_file(texts, captured(line_integrals), source);
}

}  // namespace raylign::detail
