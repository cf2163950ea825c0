#include "core/io/dicom/dicom_xray.h"

#include <cmath>
#include <vector>

#include "core/io/dicom/tag_numbers.h"

namespace raylign::detail {
namespace {

/// The tags of shutter and collimator run in parallel, 0x100 apart.
constexpr std::uint32_t kShutter = 0x00181600, kCollimator = 0x00181700;

struct Pixel {
    double x = 0, y = 0;  // from 0
};

/// Even-odd rule.
bool is_inside(const std::vector<Pixel>& polygon, double x, double y) {
    bool inside = false;
    for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
        const Pixel &a = polygon[i], &b = polygon[j];
        if ((a.y > y) != (b.y > y) && x < (b.x - a.x) * (y - a.y) / (b.y - a.y) + a.x) inside = !inside;
    }
    return inside;
}

template <typename IsShown>
void keep(Image& weights, IsShown is_shown) {
    for (int y = 0; y < weights.height; ++y) {
        for (int x = 0; x < weights.width; ++x) {
            if (!is_shown(x, y)) weights(x, y) = 0;
        }
    }
}

void keep_rectangle(const DicomTags& tags, std::uint32_t base, Image& weights) {
    const std::vector<double> left = tags.numbers(base + 2, 1), right = tags.numbers(base + 4, 1),
                              upper = tags.numbers(base + 6, 1), lower = tags.numbers(base + 8, 1);
    if (left.empty() || right.empty() || upper.empty() || lower.empty()) return;
    keep(weights, [&](int x, int y) {  // the edges themselves are the first and last pixels shown
        return x + 1 >= left[0] && x + 1 <= right[0] && y + 1 >= upper[0] && y + 1 <= lower[0];
    });
}

void keep_circle(const DicomTags& tags, std::uint32_t base, Image& weights) {
    const std::vector<double> centre = tags.numbers(base + 0x10, 2), radius = tags.numbers(base + 0x12, 1);
    if (centre.empty() || radius.empty()) return;
    keep(weights, [&](int x, int y) { return std::hypot(x + 1 - centre[1], y + 1 - centre[0]) <= radius[0]; });
}

void keep_polygon(const DicomTags& tags, std::uint32_t base, Image& weights) {
    const std::vector<double> numbers = tags.all_numbers(base + 0x20);
    if (numbers.size() < 6 || numbers.size() % 2 != 0) return;
    std::vector<Pixel> polygon;
    for (std::size_t i = 0; i < numbers.size(); i += 2) polygon.push_back({numbers[i + 1] - 1, numbers[i] - 1});
    keep(weights, [&](int x, int y) { return is_inside(polygon, x, y); });
}

}  // namespace

void take_dicom_intensity(const DicomTags& tags, RawXray& xray) {
    constexpr std::uint32_t kRelationship = 0x00281040, kSign = 0x00281041;
    const std::string relation = tags.text(kRelationship);
    if (relation == "LIN") xray.relation = IntensityRelation::linear;
    if (relation == "LOG") xray.relation = IntensityRelation::logarithmic;
    if (relation == "DISP") xray.relation = IntensityRelation::display;
    xray.relation_sign = static_cast<int>(tags.number(kSign, 0));
    if (relation == "LOG" && tags.items.contains(tag::kLutSequence)) {
        // What makes LOG linear again, and was applied on reading: DICOM PS3.3, C.8.7.1.1.2.
        xray.relation = IntensityRelation::linear;
        xray.notes.emplace_back("PixelIntensityRelationship (0028,1040) is LOG and the Modality LUT makes it LIN");
    }
    if (tags.items.contains(tag::kVoiLut) || tags.has(tag::kWindow)) {
        xray.notes.emplace_back("the file's window or VOI LUT is for display: it decides nothing here");
    }
    for (const std::uint32_t base : {kShutter, kCollimator}) {
        const std::string shapes = tags.text(base);
        if (shapes.empty()) continue;
        if (xray.shutter.empty()) xray.shutter = Image(xray.image.width, xray.image.height, 1);
        if (shapes.find("RECTANGULAR") != std::string::npos) keep_rectangle(tags, base, xray.shutter);
        if (shapes.find("CIRCULAR") != std::string::npos) keep_circle(tags, base, xray.shutter);
        if (shapes.find("POLYGONAL") != std::string::npos) keep_polygon(tags, base, xray.shutter);
    }
}

}  // namespace raylign::detail
