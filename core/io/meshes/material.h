#pragma once

#include <span>
#include <string>
#include <string_view>

#include "raylign/intensity.h"

namespace raylign::detail {

/// What a part is made of.
struct Material {
    std::string_view name;
    std::string_view composition;  ///< for reports
    std::string_view source;
};
[[nodiscard]] std::span<const Material> materials();

/// Linear attenuation [1/mm] of `text` at the preset's energy (70 keV where it has none): a material's name, "HU=N"
/// (by the preset, above its cut-off and up to 100000) or "MU=N" (1/mm, in (0, 20]). Alloys by their mass fractions w_i
/// and density rho: mu = rho sum w_i (mu / rho)_i, elements straight in the logarithms between the energies of
/// [Hubbell95], table 3. Throws Error for anything else, listing what there is.
[[nodiscard]] double attenuation_of_material(std::string_view text, const HuPreset& preset);

}  // namespace raylign::detail
