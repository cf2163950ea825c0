#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "core/evaluation/xray_parts.h"

namespace raylign::detail {
namespace {

// [Hubbell95], tables 3 and 4: water, liquid, and bone, cortical (ICRU-44) of 1.92 g/cm3.
constexpr std::array<double, 10> kEnergies_kev{10, 15, 20, 30, 40, 50, 60, 80, 100, 150};
constexpr std::array<double, 10> kWater_cm2_per_g{5.329,  1.673,  0.8096, 0.3756, 0.2683,
                                                  0.2269, 0.2059, 0.1837, 0.1707, 0.1505};
constexpr std::array<double, 10> kBone_cm2_per_g{28.51,  9.032,  4.001,  1.331,  0.6655,
                                                 0.4242, 0.3148, 0.2229, 0.1855, 0.1480};
constexpr double kBoneDensity_g_per_cm3 = 1.92;
constexpr double kDensestSoftTissue = 1.06;  // over water: muscle 1.05, blood 1.06 g/cm3 (ICRU-44), and as transparent

}  // namespace

double mass_attenuation_cm2_per_g(BodyMaterial material, double energy_kev) {
    assert(energy_kev >= kEnergies_kev.front() && energy_kev <= kEnergies_kev.back());
    const auto& table = material == BodyMaterial::water ? kWater_cm2_per_g : kBone_cm2_per_g;
    const auto next = std::upper_bound(kEnergies_kev.begin() + 1, kEnergies_kev.end() - 1, energy_kev);
    const auto i = static_cast<std::size_t>(next - kEnergies_kev.begin());
    const double share =
        std::log(energy_kev / kEnergies_kev[i - 1]) / std::log(kEnergies_kev[i] / kEnergies_kev[i - 1]);
    return table[i - 1] * std::pow(table[i] / table[i - 1], share);
}

double energy_of_units_kev(const HuPreset& units) { return units.energy_kev > 0 ? units.energy_kev : 70; }

MaterialVolumes split_materials(const Volume& volume, const HuPreset& units) {
    const double kev = energy_of_units_kev(units);
    const double bone_over_water = kBoneDensity_g_per_cm3 *
                                   mass_attenuation_cm2_per_g(BodyMaterial::cortical_bone, kev) /
                                   mass_attenuation_cm2_per_g(BodyMaterial::water, kev);
    const double soft_per_mm = kDensestSoftTissue * units.water_per_mm;
    const double bone_per_mm = bone_over_water * units.water_per_mm;
    MaterialVolumes parts{volume, volume};
    for (std::size_t i = 0; i < volume.attenuation_per_mm.size(); ++i) {
        const double all = volume.attenuation_per_mm[i];
        const double bone_volume = std::clamp((all - soft_per_mm) / (bone_per_mm - soft_per_mm), 0.0, 1.0);
        const double water = bone_volume == 0 ? all : (1 - bone_volume) * soft_per_mm;
        parts.water.attenuation_per_mm[i] = static_cast<float>(water);
        parts.bone.attenuation_per_mm[i] = static_cast<float>(all - water);
    }
    return parts;
}

}  // namespace raylign::detail
