#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/backend.h"
#include "raylign/intensity.h"

namespace raylign {

/// Photons of one energy, as a share of all that reach the detector where nothing is in the beam.
struct SpectrumLine {
    double energy_kev = 70;  ///< in [10, 150]
    double weight = 1;       ///< positive
};

/// What an X-ray set does to its images, so that simulated ones flatter less. Lengths are at the detector. Defaults:
/// nothing but the line integral.
struct XrayModel {
    std::string name = "ideal";
    std::string source;                                  ///< where its values are from
    std::vector<SpectrumLine> spectrum{SpectrumLine{}};  ///< at least one; the weights sum to 1 within 1 %
    double photons_per_mm2 = 0;   ///< where nothing is in the beam; 0 = no noise, else in [1, 1e9]
    double focal_spot_mm = 0;     ///< its width, in [0, 5]
    double scatter_ratio = 0;     ///< scatter over primary behind a wide body, per unit of its line integral, in [0, 5]
    double scatter_near_mm = 15;  ///< sigma of the kernel's narrow Gaussian, in [1, 500]
    double scatter_far_mm = 60;   ///< sigma of its wide one, in [1, 500]
    double scatter_far_share = 0.6;     ///< of the scatter that the wide one takes, in [0, 1]
    Eigen::Vector2d blade_share{0, 0};  ///< of the image's width and height under a blade at either side, in [0, 0.4]
    double round_field_share = 0;       ///< radius over half the shorter side, in [0.5, 1.5]; 0 = not round
    double marker_share = 0;            ///< height of a lead letter over the shorter side, in [0, 0.1]
    double ramp = 0;                    ///< heel effect: photons change by this share over the width, in [0, 1]
    double blur_mm = 0;                 ///< sigma of the scintillator's light, in [0, 5]
    double vignetting = 0;              ///< share of the light lost in the image's corners, in [0, 0.9]
    double electronic_noise = 0;        ///< rms, as a share of full_scale (of the open beam's signal if 0), in [0, 0.1]
    double full_scale = 0;              ///< signal that saturates, over the open beam's; in [0.05, 20], 0 = none
    double floor_share = 0;             ///< of the largest count, added to every pixel, in [0, 0.5]
    int bits = 0;                       ///< of a count, in [8, 16] (full_scale > 0 then); 0 = not counted
};

/// "ideal", "c-arm", "biplane-lab" and "flat-panel", each with the source of its values.
[[nodiscard]] std::span<const XrayModel> xray_models();
[[nodiscard]] const XrayModel& xray_model(std::string_view name);  ///< throws Error listing the valid names

/// Sigma [mm] of the Gaussian blur whose modulation transfer falls to 10 % at `cycles_per_mm`:
/// sqrt(ln(10) / 2) / (pi f).
[[nodiscard]] double blur_from_mtf10_mm(double cycles_per_mm);

/// Throws Error for a value outside its range, a spectrum without energies or whose weights do not sum to 1. `where`
/// names whose model it is.
void check_xray_model(const XrayModel& model, std::string_view where);

/// What arrives at a detector before it is counted, on samples finer than its pixels. Energy is relative to the mean
/// energy of the open beam.
struct XrayExposure {
    int samples_per_pixel = 2;              ///< along each axis
    Image energy;                           ///< mean energy per sample, 1 = the open beam's
    Image energy_squared;                   ///< sum of the squares of the photons' energies, 1 = photons of one energy
    double photons_per_sample = 0;          ///< of the open beam; 0 = no noise
    Eigen::Vector2d sample_pitch_mm{1, 1};  ///< at the detector
};

/// Primary and scatter of each view, at world_from_ct. By trilinear steps of 0.4 voxels, or joseph where the X-rays are
/// going to be registered by trilinear steps (`registers_by`), on 2x2 samples a pixel. In this order:
///   materials  each voxel is water up to 1.06 times the water of `units`, and beyond that a mixture by volume with
///              cortical bone (ICRU-44); what is beyond cortical bone (metal) is denser bone [Joseph78];
///   primary    P_e = w_e exp(-(W m_w(e) + B m_b(e))), W and B the line integrals of the two at the energy of `units`,
///              m the mass attenuation at e over that at `units` (NIST); energies e are detected as energy: a thick
///              body is more transparent than a thin one says (beam hardening);
///   field      blades and a round field, which let 0.3 % through;
///   focal spot a Gaussian of its width's variance (w^2 / 12), enlarged by (magnification - 1) at the volume's centre;
///   scatter    scatter_ratio times (P tau) smoothed by the two Gaussians, tau the line integral [Ohnesorge99];
///   marker     a letter L of lead, which lets 5 % through; then the ramp.
/// `units`: what the volume's attenuation was made with; an energy of 0 counts as 70 keV. Throws Error for a model that
/// check_xray_model refuses, a view whose pixel pitch at the detector is not known (no sdd), and what
/// Backend::prepare refuses.
[[nodiscard]] std::vector<XrayExposure> expose(const XrayModel& model, const Volume& volume, const HuPreset& units,
                                               std::span<const View> views, const RigidTransform& world_from_ct,
                                               Backend& backend, Projector registers_by = Projector::joseph);

/// The detector's counts: photons per sample (a scaled Poisson number with the mean and the variance of the sum over
/// energies), then the scintillator's blur, which correlates them, pixels, vignetting, electronic noise (white), floor,
/// saturation, whole counts. Larger = more X-rays; the pixels say so as DICOM's LIN does. Same seed, same counts.
/// Throws Error as check_xray_model does.
[[nodiscard]] RawXray detected(const XrayModel& model, const XrayExposure& exposure, std::uint64_t seed);

}  // namespace raylign
