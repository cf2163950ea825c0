#include <array>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/number_text_reader.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign::detail {
namespace {

constexpr std::array<const char*, 4> kJointTrackNumbers = {"principal distance", "x offset", "y offset", "pixel size"};

/// The words of the file, however they are spread over lines.
std::vector<std::string> words_of(const std::filesystem::path& path) {
    std::vector<std::string> words;
    for (const TextLine& line : text_lines(path)) {
        std::string word;
        for (const char c : line.text + ' ') {
            const bool ends = c == ' ' || c == '\t' || c == ',';
            if (!ends) word += c;
            if (ends && !word.empty()) words.push_back(std::exchange(word, {}));
        }
    }
    return words;
}

std::array<double, 4> calibration_numbers(const std::filesystem::path& path) {
    const std::vector<std::string> words = words_of(path);
    if (words.front() != "JT_INTCALIB" && words.front() != "JTA_INTCALIB") {
        throw bad_value("kind of calibration", words.front(),
                        "JT_INTCALIB or JTA_INTCALIB (one plane); write two planes as a views.json", path.string());
    }
    if (words.size() != 5) {
        throw bad_value("numbers of the calibration", std::to_string(words.size() - 1),
                        "4: principal distance, x and y offset, pixel size [mm]", path.string());
    }
    std::array<double, 4> numbers{};
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const std::optional<double> number = number_from(words[i + 1]);
        if (!number || !std::isfinite(*number)) {
            throw bad_value(kJointTrackNumbers[i], "\"" + words[i + 1].substr(0, 40) + "\"", "a number [mm]",
                            path.string());
        }
        numbers[i] = *number;
    }
    for (const std::size_t i : {std::size_t{0}, std::size_t{3}}) {
        if (numbers[i] > 0) continue;
        throw bad_value(kJointTrackNumbers[i], number_text(numbers[i]) + " mm", "positive", path.string());
    }
    return numbers;
}

void refuse_hints(const GeometryHints& hints, const std::string& where) {
    constexpr std::string_view kFormat = "JointTrack's calibration";
    refuse_hint(hints.sdd_mm.has_value(), "sdd_mm", kFormat, where);
    refuse_hint(hints.pixel_pitch_mm.has_value(), "pixel_pitch_mm", kFormat, where);
    refuse_hint(hints.detector_origin_mm.has_value(), "detector_origin_mm", kFormat, where);
    refuse_hint(hints.sad_mm.has_value(), "sad_mm", kFormat, where);
    refuse_hint(hints.unit_mm.has_value(), "unit_mm", kFormat, where);
    refuse_hint(hints.primary_angle_deg || hints.secondary_angle_deg, "an angle", kFormat, where);
    refuse_hint(hints.item != 0, "a frame or projection", kFormat, where);
}

}  // namespace

std::vector<GeometryView> read_jointtrack(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    refuse_hints(hints, where);
    const auto [distance_mm, x_offset_mm, y_offset_mm, pixel_mm] = calibration_numbers(path);
    StoredProjection stored;
    stored.size_px = settled_size(std::nullopt, hints, where);
    Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
    intrinsics(0, 0) = intrinsics(1, 1) = distance_mm / pixel_mm;
    intrinsics(0, 2) = stored.size_px.x() / 2.0 + x_offset_mm / pixel_mm;
    intrinsics(1, 2) = stored.size_px.y() / 2.0 - 1 - y_offset_mm / pixel_mm;
    const Eigen::Matrix3d rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
    stored.pixel_from_world = projection_of(intrinsics, rotation, Eigen::Vector3d::Zero());
    stored.sdd_mm = distance_mm;
    stored.assumptions = {
        "JointTrack: the source is the world's origin, x to the right of the image, y up, z from the image to the "
        "source; with offsets 0 the central ray hits pixel (W / 2, H / 2), counted from the lower left one"};
    return {finish_view(std::move(stored), hints, path.stem().string(), where)};
}

}  // namespace raylign::detail
