#include "raylign/intensity.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/image/auto_mask.h"
#include "core/image/field_of_view.h"

namespace raylign {
using namespace detail;
namespace {

constexpr double kI0Percentile = 0.995;     // open beam; above it lie hot pixels
constexpr double kRangePercentile = 0.001;  // of each end: dead and hot pixels do not set the range
constexpr double kBandShare = 0.005;        // of the range: one count in 8 bits, what saturation or air noise fills
constexpr double kLeastAirShare = 0.01;     // of the pixels; fewer may be metal or markers
constexpr double kDarkShare = 0.1;          // of the range: blooming and scatter outside the field stay below
constexpr double kFloatFloorShare = 1e-4;   // of I0: beyond the range of a 14-bit detector

/// Value below which `share` of the values lie. Reorders them.
double percentile(std::vector<float>& values, double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
}

bool is_usable(const Image& image, const Image& weights, std::size_t i) {
    return std::isfinite(image.pixels[i]) && (weights.empty() || weights.pixels[i] > 0);
}

std::vector<float> usable_pixels(const Image& image, const Image& weights) {
    std::vector<float> values;
    values.reserve(image.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (is_usable(image, weights, i)) values.push_back(image.pixels[i]);
    }
    return values;
}

/// The two ends of the grey values, where air (or what lies outside the field of view) gathers.
struct Extremes {
    double low = 0, high = 0;              // robust ends of the range
    double low_share = 0, high_share = 0;  // of the usable pixels within the band at each end
    [[nodiscard]] bool is_low(double value) const { return value <= low + kBandShare * (high - low); }
    [[nodiscard]] bool is_high(double value) const { return value >= high - kBandShare * (high - low); }
};

Extremes extremes_of(std::vector<float>& values) {
    Extremes e{percentile(values, kRangePercentile), percentile(values, 1 - kRangePercentile)};
    const auto count = static_cast<double>(values.size());
    e.low_share = static_cast<double>(std::ranges::count_if(values, [&](float v) { return e.is_low(v); })) / count;
    e.high_share = static_cast<double>(std::ranges::count_if(values, [&](float v) { return e.is_high(v); })) / count;
    return e;
}

/// The field about the image's middle, or else a round or polygonal one anywhere. Empty where there is no dark frame.
Image framed_field(const RawXray& raw, const Image& weights, const Extremes& e) {
    if (e.low_share < kLeastAirShare) return {};
    Image field = field_of_view_weights(raw.image, weights, static_cast<float>(e.low + kDarkShare * (e.high - e.low)));
    constexpr double kLeastRadiusShare = 0.42;  // a bright body in dark air must not pass for a field here
    if (field.empty()) field = mask_frame(raw.image, weights, kLeastRadiusShare).weights;
    return field;
}

/// Weights 0 outside the field of view.
void exclude_outside(const Image& field, XrayConversion& result) {
    if (result.weights.empty()) result.weights = Image(field.width, field.height, 1);
    for (std::size_t i = 0; i < field.pixels.size(); ++i) result.weights.pixels[i] *= field.pixels[i];
    const auto outside = static_cast<double>(std::ranges::count(field.pixels, 0.0F));
    result.decisions.push_back(text_of("field of view: the dark border and 2 px within it, ",
                                       100 * outside / static_cast<double>(field.pixels.size()),
                                       " % of the pixels, are outside and get weight 0"));
}

std::string shown_dark_text(const RawXray& raw) {
    return raw.shown_dark_by.empty() ? "the image is MONOCHROME1" : raw.shown_dark_by;
}

Polarity settle_transmission_polarity(const RawXray& raw, const Extremes& e, bool has_dark_frame,
                                      std::vector<std::string>& decisions) {
    if (raw.relation_sign != 0 || raw.relation == IntensityRelation::linear) {
        const bool is_less = raw.relation_sign < 0;
        decisions.push_back(text_of("polarity: bone ", is_less ? "bright" : "dark",
                                    raw.relation_sign != 0 ? ", by PixelIntensityRelationshipSign (0028,1041)"
                                                           : ", as PixelIntensityRelationship (0028,1040) is LIN"));
        return is_less ? Polarity::bone_bright : Polarity::bone_dark;
    }
    if (raw.monochrome1) {
        decisions.push_back("polarity: bone dark, as " + shown_dark_text(raw) + " (large values are shown dark)");
        return Polarity::bone_dark;
    }
    const std::string numbers = text_of(100 * e.low_share, " % of the pixels at the dark end (", e.low, "), ",
                                        100 * e.high_share, " % at the bright end (", e.high, ")");
    if (has_dark_frame && e.high_share >= kLeastAirShare) {
        decisions.push_back(
            "polarity: bone dark, as air gathers at the bright end; the dark border is round or "
            "rectangular and is taken as outside the field of view: " +
            numbers);
        return Polarity::bone_dark;
    }
    const double dark_air_share = has_dark_frame ? 0 : e.low_share;
    if (std::max(dark_air_share, e.high_share) < kLeastAirShare) {
        decisions.push_back("polarity: bone dark, assumed as for a detector's counts, since no air is seen: " +
                            numbers);
        return Polarity::bone_dark;
    }
    const bool air_is_bright = e.high_share >= dark_air_share;
    decisions.push_back(text_of("polarity: bone ", air_is_bright ? "dark" : "bright", ", as air gathers at the ",
                                air_is_bright ? "bright" : "dark", " end: ", numbers));
    return air_is_bright ? Polarity::bone_dark : Polarity::bone_bright;
}

IntensityKind settle_kind(const RawXray& raw, const IntensitySettings& settings, std::vector<std::string>& decisions) {
    if (settings.kind != IntensityKind::automatic) return settings.kind;
    if (raw.relation == IntensityRelation::linear || raw.relation == IntensityRelation::logarithmic) {
        const bool is_linear = raw.relation == IntensityRelation::linear;
        decisions.push_back(text_of("kind: ", is_linear ? "transmission" : "line integral up to a factor",
                                    ", as PixelIntensityRelationship (0028,1040) is ", is_linear ? "LIN" : "LOG"));
        return is_linear ? IntensityKind::transmission : IntensityKind::line_integral;
    }
    if (raw.relation == IntensityRelation::display) {
        decisions.emplace_back(
            "PixelIntensityRelationship (0028,1040) is DISP: the pixels were made up for display, "
            "their logarithm is only roughly a line integral");
    }
    decisions.emplace_back(raw.integer_pixels ? "kind: transmission, as the pixels are integers"
                                              : "kind: line integral, as the pixels are floating point");
    return raw.integer_pixels ? IntensityKind::transmission : IntensityKind::line_integral;
}

double settle_i0(const IntensitySettings& settings, std::vector<float>& intensities, std::string_view where,
                 std::vector<std::string>& decisions) {
    if (settings.i0) {
        if (!(*settings.i0 > 0 && std::isfinite(*settings.i0))) {
            throw bad_value("intensity.i0", text_of(*settings.i0), "positive and finite", where);
        }
        return *settings.i0;
    }
    const double i0 = percentile(intensities, kI0Percentile);
    if (!(i0 > 0)) {
        throw bad_value("open-beam intensity I0 (99.5th percentile)", text_of(i0), "positive; give intensity.i0",
                        where);
    }
    decisions.push_back(text_of("I0 = ", i0, ", the 99.5th percentile of the pixels in use"));
    return i0;
}

/// Turns the image upside down for bone_bright, so that it holds intensities (air large).
void make_intensities(Image& image, const RawXray& raw, Polarity polarity, const std::vector<float>& values,
                      std::vector<std::string>& decisions) {
    if (polarity != Polarity::bone_bright) return;
    const bool has_top = raw.max_representable > 0;
    const auto top = static_cast<float>(has_top ? raw.max_representable : *std::ranges::max_element(values));
    for (float& value : image.pixels) value = top - value;
    decisions.push_back(text_of("inverted: intensity = ", top, " - pixel (",
                                has_top ? "largest value of the pixel type" : "largest pixel", ")"));
}

void take_log(Image& image, double i0, double floor_intensity, std::vector<std::string>& decisions) {
    std::size_t floored = 0;
    for (float& value : image.pixels) {
        if (!std::isfinite(value)) continue;
        floored += value < floor_intensity;
        value = static_cast<float>(-std::log(std::max<double>(value, floor_intensity) / i0));
    }
    if (floored > 0) {
        decisions.push_back(
            text_of(floored, " pixels below ", floor_intensity, " were raised to it before the logarithm"));
    }
}

/// Multiplies `mask` into the weights and says what it left out.
void apply_mask(const AutoMask& mask, std::string_view where, XrayConversion& result) {
    if (!mask.weights.empty()) {
        if (result.weights.empty()) result.weights = Image(mask.weights.width, mask.weights.height, 1);
        for (std::size_t i = 0; i < mask.weights.pixels.size(); ++i) result.weights.pixels[i] *= mask.weights.pixels[i];
    }
    for (const std::string& decision : mask.decisions) result.decisions.push_back("auto-mask: " + decision);
    const bool is_empty =
        !result.weights.empty() && std::ranges::none_of(result.weights.pixels, [](float w) { return w > 0; });
    if (is_empty)
        throw Error("image " + std::string(where) + ": the automatic mask leaves no pixel; give a mask of your own");
}

AutoMask framed_or_stepped(const Image& intensities, const Image& weights) {
    AutoMask mask = mask_frame(intensities, weights);
    return mask.weights.empty() ? mask_stepped_field(intensities, weights) : mask;
}

/// `has_frame`: the field's frame was left out already.
void apply_frame_and_marks(const RawXray& raw, const Image& intensities, bool has_frame, std::string_view where,
                           XrayConversion& result) {
    if (!raw.shutter.empty()) {
        const auto shut = static_cast<double>(std::ranges::count(raw.shutter.pixels, 0.0F));
        apply_mask({raw.shutter,
                    {text_of("shutter and collimator by the file's tags, ",
                             100 * shut / static_cast<double>(raw.shutter.pixels.size()), " % of the pixels")}},
                   where, result);
    }
    if (!has_frame) apply_mask(framed_or_stepped(intensities, result.weights), where, result);
    apply_mask(mask_marks(intensities, result.weights), where, result);
}

void convert_transmission(const RawXray& raw, const IntensitySettings& settings, std::string_view where,
                          XrayConversion& result) {
    std::vector<float> values = usable_pixels(raw.image, result.weights);
    Polarity polarity = settings.polarity;
    const Extremes extremes = extremes_of(values);
    const Image field = polarity == Polarity::bone_bright ? Image() : framed_field(raw, result.weights, extremes);
    if (polarity == Polarity::automatic) {
        polarity = settle_transmission_polarity(raw, extremes, !field.empty(), result.decisions);
    }
    if (!field.empty()) exclude_outside(field, result);
    make_intensities(result.line_integral, raw, polarity, values, result.decisions);
    const Image intensities = settings.auto_mask ? result.line_integral : Image();
    if (settings.auto_mask) apply_frame_and_marks(raw, intensities, !field.empty(), where, result);
    values = usable_pixels(result.line_integral, result.weights);
    if (values.empty()) throw Error("image " + std::string(where) + ": its mask leaves no pixel of the field of view");
    const double i0 = settle_i0(settings, values, where, result.decisions);
    // After I0, which saturated air would miss.
    if (settings.auto_mask) apply_mask(mask_clipped(intensities, raw.max_representable), where, result);
    take_log(result.line_integral, i0, raw.integer_pixels ? 0.5 : kFloatFloorShare * i0, result.decisions);
}

/// Logarithmic pixels have an arbitrary zero: the thinnest 0.5 % of the pixels in use are air.
void subtract_air(XrayConversion& result) {
    std::vector<float> values = usable_pixels(result.line_integral, result.weights);
    if (values.empty()) return;
    const double air = percentile(values, 1 - kI0Percentile);
    for (float& value : result.line_integral.pixels) value -= static_cast<float>(air);
    result.decisions.push_back(text_of("logarithmic pixels: ", air, " was subtracted, the 0.5th percentile (air)"));
}

/// Line integrals have no scale of intensities: their range stands for a factor of 20.
void mask_line_integrals(const RawXray& raw, std::string_view where, XrayConversion& result) {
    std::vector<float> values = usable_pixels(result.line_integral, result.weights);
    if (values.empty()) return;
    const Extremes extremes = extremes_of(values);
    const double range = extremes.high - extremes.low;
    if (!(range > 0)) return;
    Image intensities = result.line_integral;
    for (float& value : intensities.pixels) value = static_cast<float>(std::exp(-3 * (value - extremes.low) / range));
    apply_frame_and_marks(raw, intensities, false, where, result);
    if (raw.integer_pixels) apply_mask(mask_clipped(raw.image, raw.max_representable), where, result);
}

void convert_line_integral(const RawXray& raw, const IntensitySettings& settings, std::string_view where,
                           XrayConversion& result) {
    Polarity polarity = settings.polarity;
    if (polarity == Polarity::automatic && (raw.relation_sign != 0 || raw.relation == IntensityRelation::logarithmic)) {
        polarity = raw.relation_sign < 0 ? Polarity::bone_bright : Polarity::bone_dark;
        result.decisions.push_back(text_of("polarity: bone ", raw.relation_sign < 0 ? "bright" : "dark", ", by ",
                                           raw.relation_sign != 0 ? "PixelIntensityRelationshipSign (0028,1041)"
                                                                  : "PixelIntensityRelationship (0028,1040)"));
    } else if (polarity == Polarity::automatic) {
        polarity = raw.monochrome1 ? Polarity::bone_dark : Polarity::bone_bright;
        result.decisions.push_back(raw.monochrome1 ? "polarity: bone dark, as " + shown_dark_text(raw)
                                                   : "polarity: bone bright, as is usual for line integrals");
    }
    if (polarity == Polarity::bone_dark) {
        for (float& value : result.line_integral.pixels) value = -value;
    }
    if (raw.relation == IntensityRelation::logarithmic) subtract_air(result);
    if (settings.auto_mask) mask_line_integrals(raw, where, result);
}

/// Weights: the mask, with 0 at pixels that are not finite. Those become 0, so that 0 * pixel is 0 and not NaN.
void exclude_non_finite(XrayConversion& result) {
    std::size_t excluded = 0;
    for (std::size_t i = 0; i < result.line_integral.pixels.size(); ++i) {
        if (std::isfinite(result.line_integral.pixels[i])) continue;
        if (result.weights.empty()) result.weights = Image(result.line_integral.width, result.line_integral.height, 1);
        result.weights.pixels[i] = 0;
        result.line_integral.pixels[i] = 0;
        ++excluded;
    }
    if (excluded > 0) result.decisions.push_back(text_of(excluded, " pixels are not finite and are ignored"));
}

}  // namespace

XrayConversion line_integral_from_xray(const RawXray& raw, const Image& mask, const IntensitySettings& settings,
                                       std::string_view where) {
    const auto size = [](const Image& image) { return text_of(image.width, " x ", image.height); };
    if (!mask.empty() && (mask.width != raw.image.width || mask.height != raw.image.height)) {
        throw bad_value("mask size", size(mask), "the image's, " + size(raw.image), where);
    }
    XrayConversion result{raw.image, mask, raw.notes};
    if (usable_pixels(raw.image, {}).empty()) throw Error("image " + std::string(where) + ": has no finite pixel");
    if (!raw.valid.empty()) {
        if (mask.empty()) result.weights = Image(raw.image.width, raw.image.height, 1);
        for (std::size_t i = 0; i < raw.valid.pixels.size(); ++i) result.weights.pixels[i] *= raw.valid.pixels[i];
    }
    if (usable_pixels(raw.image, result.weights).empty()) {
        throw Error("image " + std::string(where) + ": no finite pixel is left by its mask");
    }
    if (settle_kind(raw, settings, result.decisions) == IntensityKind::transmission) {
        convert_transmission(raw, settings, where, result);
    } else {
        convert_line_integral(raw, settings, where, result);
    }
    exclude_non_finite(result);
    return result;
}

}  // namespace raylign
