#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/image.h"

namespace raylign {

/// HU to linear attenuation: mu = water_per_mm * (1 + HU / 1000), and 0 at or below the cut-off (air and noise around
/// it).
struct HuPreset {
    std::string_view name;
    double energy_kev;  ///< effective energy the preset stands for; 0 = another tool's habit
    double water_per_mm;
    double cutoff_hu;
    std::string_view source;
};
[[nodiscard]] std::span<const HuPreset> hu_presets();            ///< the default first
[[nodiscard]] const HuPreset& hu_preset(std::string_view name);  ///< throws Error listing the valid names
[[nodiscard]] float attenuation_from_hu(double hu, const HuPreset& preset);

/// What pixels are: logarithms already, or what is left of the beam (0 = none of it).
enum class IntensityKind { automatic, line_integral, transmission };
/// Whether bone has the larger or the smaller pixel values.
enum class Polarity { automatic, bone_bright, bone_dark };

/// How an X-ray's pixels become line integrals (views.json "intensity").
struct IntensitySettings {
    IntensityKind kind = IntensityKind::automatic;
    Polarity polarity = Polarity::automatic;
    std::optional<double> i0;  ///< open-beam intensity of a transmission image; default: settled from the image
    bool auto_mask = false;    ///< also leave out shutter, collimator, letters, saturated and zero pixels
};

/// What a DICOM file says of its pixels (0028,1040): proportional to the X-rays that arrive, to their logarithm, or
/// made up for display.
enum class IntensityRelation { unknown, linear, logarithmic, display };

/// Pixels as read from a file.
struct RawXray {
    Image image;
    bool integer_pixels = false;   ///< stored as integers: a detector's counts rather than line integrals
    double max_representable = 0;  ///< of the stored type, e.g. 255; 0 for float
    bool monochrome1 = false;      ///< large values are to be shown dark
    std::string shown_dark_by;     ///< the tags that say so; "" = the format's only one
    IntensityRelation relation = IntensityRelation::unknown;
    int relation_sign = 0;  ///< DICOM (0028,1041): 1 = larger pixels for more X-rays, -1 = for fewer, 0 = not said
    Image shutter;          ///< DICOM shutter and collimator tags: 0 outside; empty = none
    Image valid;            ///< 0 where a pixel is no image (DICOM padding), 1 elsewhere; empty = all are
    std::vector<std::string> notes;  ///< what was decided on reading the file, and what it says besides
};

/// An X-ray as a View takes it.
struct XrayConversion {
    Image line_integral;  ///< denser = larger
    Image weights;        ///< given mask; 0 where not finite or outside a framed field of view; empty = all ones
    std::vector<std::string> decisions;  ///< the file's notes; what was settled automatically and from what
};

/// transmission: -log(I / I0) with I floored at a small positive share of I0; line integral: as is, sign by polarity.
/// Automatic kind: what DICOM's intensity relationship says, else integer pixels are transmission, float pixels line
/// integrals. Automatic polarity: its sign, else MONOCHROME1, else where the air gathers. Logarithmic pixels are line
/// integrals up to a factor: air (the 99.5th percentile of thinness) becomes 0.
/// Throws Error for I0 <= 0, sizes that differ, or an image without any finite pixel. `where` names the file.
[[nodiscard]] XrayConversion line_integral_from_xray(const RawXray& raw, const Image& mask,
                                                     const IntensitySettings& settings, std::string_view where);

}  // namespace raylign
