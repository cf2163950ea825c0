#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/evaluation/xray_parts.h"
#include "core/geometry/camera.h"

namespace raylign {
using namespace detail;
namespace {

constexpr int kSamplesPerPixel = 2;
constexpr double kStep_voxels = 0.4;  // finer than the registration's, and no divisor of it
constexpr double kLeastTau = -13;     // as with_photon_noise: negative attenuation of no body

/// One energy: its share of the photons, its energy over the open beam's mean, and both materials' attenuation over
/// that at the energy of the paths.
struct EnergyBin {
    double weight, energy, water, bone;
};

std::vector<EnergyBin> energy_bins(const std::vector<SpectrumLine>& spectrum, double paths_kev) {
    double weights = 0, energies = 0;
    for (const SpectrumLine& line : spectrum) {
        weights += line.weight;
        energies += line.weight * line.energy_kev;
    }
    const auto ratio = [&](BodyMaterial material, double kev) {
        return mass_attenuation_cm2_per_g(material, kev) / mass_attenuation_cm2_per_g(material, paths_kev);
    };
    std::vector<EnergyBin> bins;
    for (const SpectrumLine& line : spectrum) {
        bins.push_back({line.weight / weights, line.energy_kev * weights / energies,
                        ratio(BodyMaterial::water, line.energy_kev),
                        ratio(BodyMaterial::cortical_bone, line.energy_kev)});
    }
    return bins;
}

/// The energy and the sum of squared energies of photons, per sample.
struct Moments {
    Image energy, squared;
};

struct Beam {
    Moments primary, scattering;  ///< what passes, and what passes and scatters: P tau
};

Beam pass(const MaterialPaths& paths, const std::vector<EnergyBin>& bins, const Image& field) {
    const Image none(paths.water.width, paths.water.height);
    Beam beam{{none, none}, {none, none}};
    for (std::size_t i = 0; i < none.pixels.size(); ++i) {
        double sums[4] = {};
        for (const EnergyBin& bin : bins) {
            const double tau = bin.water * paths.water.pixels[i] + bin.bone * paths.bone.pixels[i];
            if (!(std::isfinite(tau) && tau >= kLeastTau)) {
                throw bad_value("line integral", text_of(tau), "finite and at least -13", "the volume to X-ray");
            }
            const double energy = bin.energy * field.pixels[i] * bin.weight * std::exp(-tau);
            const double scatters = std::max(tau, 0.0);
            sums[0] += energy;
            sums[1] += bin.energy * energy;
            sums[2] += scatters * energy;
            sums[3] += scatters * bin.energy * energy;
        }
        beam.primary.energy.pixels[i] = static_cast<float>(sums[0]);
        beam.primary.squared.pixels[i] = static_cast<float>(sums[1]);
        beam.scattering.energy.pixels[i] = static_cast<float>(sums[2]);
        beam.scattering.squared.pixels[i] = static_cast<float>(sums[3]);
    }
    return beam;
}

/// Adds what scatters; the kernel is wide, so that one value a pixel serves all of its samples.
void add_scatter(const XrayModel& model, const MaterialPaths& paths, const Image& scattering, Image& image) {
    const int k = paths.samples_per_pixel;
    const Image source = binned(scattering, k);
    const double pitch_mm = k * std::sqrt(paths.sample_pitch_mm.prod());
    const Image near = spread_out(source, model.scatter_near_mm / pitch_mm);
    const Image far = spread_out(source, model.scatter_far_mm / pitch_mm);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const double smooth =
                (1 - model.scatter_far_share) * near(x / k, y / k) + model.scatter_far_share * far(x / k, y / k);
            image(x, y) += static_cast<float>(model.scatter_ratio * smooth);
        }
    }
}

/// What the marker lets through, times the ramp of the heel effect along the columns.
Image last_factors(const XrayModel& model, int width, int height) {
    Image factors = marker_transmission(model, width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) factors(x, y) *= static_cast<float>(1 + model.ramp * ((x + 0.5) / width - 0.5));
    }
    return factors;
}

/// Two samples a pixel along each axis.
View finely_sampled(const View& view) {
    View fine{view.name, view.geometry, {}, {}};
    fine.geometry.camera = finer(view.geometry.camera, kSamplesPerPixel);
    return fine;
}

/// The focal spot's image at the detector, of an edge at the volume's centre: sigma = w / sqrt(12) (sdd / z - 1).
double penumbra_mm(const XrayModel& model, const View& view, const Eigen::Vector3d& centre_world) {
    const double depth_mm = (view.geometry.camera_from_world * centre_world).z();
    const double magnification = *view.geometry.camera.sdd_mm / depth_mm;
    return model.focal_spot_mm / std::sqrt(12.0) * std::max(magnification - 1, 0.0);
}

}  // namespace

XrayExposure detail::expose_paths(const XrayModel& model, const MaterialPaths& paths) {
    const int width = paths.water.width, height = paths.water.height;
    Beam beam = pass(paths, energy_bins(model.spectrum, paths.energy_kev), field_transmission(model, width, height));
    const Image factors = last_factors(model, width, height);
    const auto finish = [&](const Image& primary, const Image& scattering) {
        Image image = primary;
        const Eigen::Vector2d penumbra_px =
            Eigen::Vector2d::Constant(paths.penumbra_mm).cwiseQuotient(paths.sample_pitch_mm);
        if (paths.penumbra_mm > 0) image = blurred(image, penumbra_px);
        if (model.scatter_ratio > 0) add_scatter(model, paths, scattering, image);
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] *= factors.pixels[i];
        return image;
    };
    return {paths.samples_per_pixel, finish(beam.primary.energy, beam.scattering.energy),
            finish(beam.primary.squared, beam.scattering.squared), model.photons_per_mm2 * paths.sample_pitch_mm.prod(),
            paths.sample_pitch_mm};
}

std::vector<XrayExposure> expose(const XrayModel& model, const Volume& volume, const HuPreset& units,
                                 std::span<const View> views, const RigidTransform& world_from_ct, Backend& backend,
                                 Projector registers_by) {
    check_xray_model(model, "X-ray model " + model.name);
    std::vector<View> fine;
    for (const View& view : views) {
        if (!view.geometry.camera.pixel_pitch_mm()) {
            throw Error("view " + view.name + ": its camera has no sdd, so that lengths at the detector are not known");
        }
        fine.push_back(finely_sampled(view));
    }
    RenderSettings other{Projector::joseph, {}};
    if (registers_by == Projector::joseph) {
        other = {Projector::trilinear, kStep_voxels * volume.grid.spacing_mm.minCoeff()};
    }
    const MaterialVolumes parts = split_materials(volume, units);
    const auto water = backend.prepare({parts.water, fine, other, {}});
    const auto bone = backend.prepare({parts.bone, fine, other, {}});
    const Eigen::Vector3d centre_world = world_from_ct * volume.grid.centre_ct_mm();
    std::vector<XrayExposure> exposures;
    for (std::size_t v = 0; v < fine.size(); ++v) {
        exposures.push_back(expose_paths(model, {water->render(world_from_ct, v), bone->render(world_from_ct, v),
                                                 energy_of_units_kev(units), *fine[v].geometry.camera.pixel_pitch_mm(),
                                                 penumbra_mm(model, fine[v], centre_world), kSamplesPerPixel}));
    }
    return exposures;
}

}  // namespace raylign
