#pragma once

#include <Eigen/Core>

#include "raylign/xray.h"

namespace raylign::detail {

// The parts of expose() and detected(), for tests.

enum class BodyMaterial { water, cortical_bone };

/// Mass attenuation coefficient [cm^2/g], between the energies of the table straight in the logarithms of both
/// [Hubbell95]. `energy_kev` in [10, 150].
[[nodiscard]] double mass_attenuation_cm2_per_g(BodyMaterial material, double energy_kev);

/// The attenuation of a volume at the energy of its units, shared between two materials: their sum is the volume.
struct MaterialVolumes {
    Volume water, bone;
};
[[nodiscard]] MaterialVolumes split_materials(const Volume& volume, const HuPreset& units);

/// The energy that the units stand for: 70 keV for another tool's habit.
[[nodiscard]] double energy_of_units_kev(const HuPreset& units);

/// Line integrals of both materials at `energy_kev`, one a sample, and where the samples are.
struct MaterialPaths {
    Image water, bone;
    double energy_kev = 70;
    Eigen::Vector2d sample_pitch_mm{1, 1};
    double penumbra_mm = 0;  ///< sigma of the focal spot's blur at the detector
    int samples_per_pixel = 2;
};
/// From the primary on, as expose() says.
[[nodiscard]] XrayExposure expose_paths(const XrayModel& model, const MaterialPaths& paths);

/// Gaussian blur, each tap the integral over its pixel; borders repeat, so that the mean of a constant image is kept.
/// Sigmas per axis [px], not negative; any size.
[[nodiscard]] Image blurred(const Image& image, const Eigen::Vector2d& sigma_px);

/// Wide blur of an image with nothing around it: what leaves it is lost, the rest of the sum is kept. Sigma below 1 px
/// counts as 1.
[[nodiscard]] Image spread_out(const Image& image, double sigma_px);

/// Mean of k x k samples.
[[nodiscard]] Image binned(const Image& samples, int k);

/// What blades and a round field let through, and the lead letter, per sample.
[[nodiscard]] Image field_transmission(const XrayModel& model, int width, int height);
[[nodiscard]] Image marker_transmission(const XrayModel& model, int width, int height);

}  // namespace raylign::detail
