#include <array>

#include "core/base/error.h"
#include "raylign/intensity.h"

namespace raylign {
using namespace detail;
namespace {

constexpr std::string_view kNist = "water in NIST NISTIR 5632 (Hubbell and Seltzer 1995), density 1 g/cm3";
constexpr std::array<HuPreset, 4> kPresets = {{
    {"water-70kev", 70, 0.0193, -900, kNist},
    {"water-60kev", 60, 0.0206, -900, kNist},
    {"water-80kev", 80, 0.0184, -900, kNist},
    {"plastimatch", 0, 0.022, -800, "the habit of plastimatch's drr"},
}};

}  // namespace

std::span<const HuPreset> hu_presets() { return kPresets; }

const HuPreset& hu_preset(std::string_view name) {
    std::string allowed;
    for (const HuPreset& preset : kPresets) {
        if (preset.name == name) return preset;
        allowed += (allowed.empty() ? "one of " : ", ") + std::string(preset.name);
    }
    throw bad_value("HU preset", name, allowed);
}

float attenuation_from_hu(double hu, const HuPreset& preset) {
    if (hu <= preset.cutoff_hu) return 0;
    return static_cast<float>(preset.water_per_mm * (1 + hu / 1000));
}

}  // namespace raylign
