#include "core/io/meshes/material.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/text.h"

namespace raylign::detail {
namespace {

// [Hubbell95], table 3, and table 4 for bone, cortical (ICRU-44): mu / rho [cm^2/g].
constexpr std::array<double, 4> kEnergies_kev{50, 60, 80, 100};
using Coefficients = std::array<double, 4>;
constexpr Coefficients kHydrogen{0.3355, 0.3260, 0.3091, 0.2944}, kCarbon{0.1871, 0.1753, 0.1610, 0.1514},
    kAluminium{0.3681, 0.2778, 0.2018, 0.1704}, kTitanium{1.213, 0.7661, 0.4052, 0.2721},
    kVanadium{1.347, 0.8438, 0.4371, 0.2877}, kChromium{1.550, 0.9639, 0.4905, 0.3166},
    kIron{1.958, 1.205, 0.5952, 0.3717}, kCobalt{2.144, 1.314, 0.6414, 0.3949}, kNickel{2.474, 1.512, 0.7306, 0.4440},
    kMolybdenum{7.037, 4.274, 1.962, 1.096}, kCorticalBone{0.4242, 0.3148, 0.2229, 0.1855};

struct Share {
    const Coefficients* element = nullptr;
    double mass = 0;
};
struct Alloy {
    std::array<Share, 4> shares;
    double density_g_per_cm3;
};

constexpr std::array<Material, 5> kMaterials = {{
    {"cobalt-chrome", "65 % Co, 28.5 % Cr, 6.5 % Mo; 8.3 g/cm3", "ASTM F75"},
    {"titanium", "Ti-6Al-4V; 4.43 g/cm3", "ASTM F136"},
    {"steel", "316L: 66 % Fe, 17.5 % Cr, 14 % Ni, 2.5 % Mo; 8.0 g/cm3", "ASTM F138"},
    {"polyethylene", "UHMWPE, (CH2)n; 0.94 g/cm3", "ASTM F648"},
    {"bone", "cortical; 1.92 g/cm3", "ICRU-44"},
}};
constexpr std::array<Alloy, 5> kAlloys = {{
    {{{{&kCobalt, 0.65}, {&kChromium, 0.285}, {&kMolybdenum, 0.065}, {}}}, 8.3},
    {{{{&kTitanium, 0.90}, {&kAluminium, 0.06}, {&kVanadium, 0.04}, {}}}, 4.43},
    {{{{&kIron, 0.66}, {&kChromium, 0.175}, {&kNickel, 0.14}, {&kMolybdenum, 0.025}}}, 8.0},
    {{{{&kHydrogen, 0.1437}, {&kCarbon, 0.8563}, {}, {}}}, 0.94},
    {{{{&kCorticalBone, 1}, {}, {}, {}}}, 1.92},
}};

double at_energy(const Coefficients& table, double kev) {
    std::size_t i = 1;
    while (i + 1 < kEnergies_kev.size() && kEnergies_kev[i] < kev) ++i;
    const double share = std::log(kev / kEnergies_kev[i - 1]) / std::log(kEnergies_kev[i] / kEnergies_kev[i - 1]);
    return table[i - 1] * std::pow(table[i] / table[i - 1], share);
}

double alloy_per_mm(const Alloy& alloy, double kev) {
    double cm2_per_g = 0;
    for (const Share& share : alloy.shares) {
        if (share.element != nullptr) cm2_per_g += share.mass * at_energy(*share.element, kev);
    }
    return cm2_per_g * alloy.density_g_per_cm3 / 10;
}

std::string allowed() {
    std::string text;
    for (const Material& material : kMaterials) text += std::string(material.name) + ", ";
    return text + "HU=N or MU=N (1/mm)";
}

double number_after(std::string_view text, std::string_view all) {
    double value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (status == std::errc{} && end == text.data() + text.size() && std::isfinite(value)) return value;
    throw bad_value("material", all, allowed());
}

}  // namespace

std::span<const Material> materials() { return kMaterials; }

double attenuation_of_material(std::string_view text, const HuPreset& preset) {
    if (text.starts_with("HU=")) {
        const double hu = number_after(text.substr(3), text);
        if (!(hu > preset.cutoff_hu && hu <= 1e5)) {
            throw bad_value("material", text,
                            "above the preset's cut-off, " + number_text(preset.cutoff_hu) + " HU, and up to 100000");
        }
        return attenuation_from_hu(hu, preset);
    }
    if (text.starts_with("MU=")) {
        const double per_mm = number_after(text.substr(3), text);
        if (!(per_mm > 0 && per_mm <= 20)) throw bad_value("material", text, "in (0, 20] per mm");
        return per_mm;
    }
    const auto found = std::ranges::find(kMaterials, text, &Material::name);
    if (found == kMaterials.end()) throw bad_value("material", text, allowed());
    return alloy_per_mm(kAlloys[static_cast<std::size_t>(found - kMaterials.begin())],
                        preset.energy_kev > 0 ? preset.energy_kev : 70);
}

}  // namespace raylign::detail
