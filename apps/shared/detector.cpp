#include "apps/shared/detector.h"

#include "apps/shared/parse.h"
#include "apps/shared/simulated_views.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/files/csv.h"

namespace raylign::detail::apps {
namespace {

std::vector<SpectrumLine> read_spectrum(const std::filesystem::path& file) {
    std::vector<SpectrumLine> spectrum;
    double sum = 0;
    for (const CsvRow& row : csv_rows(file)) {
        if (row.cells.size() != 2) throw bad_value("row", joined(row.cells, ","), "energy in keV, photons", row.where);
        const double photons = csv_number(row.cells[1], "photons", "a number, not negative", row.where);
        const double kev = csv_number(row.cells[0], "energy", "in [10, 150] keV", row.where);
        if (!(photons >= 0)) throw bad_value("photons", row.cells[1], "not negative", row.where);
        if (photons == 0) continue;  // tables begin and end with them
        if (!(kev >= 10 && kev <= 150)) throw bad_value("energy", row.cells[0], "in [10, 150] keV", row.where);
        spectrum.push_back({kev, photons});
        sum += photons;
    }
    for (SpectrumLine& line : spectrum) line.weight /= sum;
    return spectrum;
}

}  // namespace

void add_detector_flags(CLI::App& command, DetectorFlags& flags, const char* group) {
    describe(command.add_option("--xray", flags.xray,
                                "What the simulated X-ray set does: " + joined(xray_models(), &XrayModel::name, ", ") +
                                    ";\ndefault ideal: line integrals alone, which flatter"),
             "MODEL", group);
    describe(command.add_option("--spectrum", flags.spectrum,
                                "Table of keV and photons before the body, in place of the model's; default none"),
             "FILE", group);
    describe(command.add_option("--noise", flags.noise_photons,
                                "Photons of an unattenuated pixel of simulated X-rays, 1 to 1e9, 0 = no noise;\n"
                                "default 0, or the model's own"),
             "PHOTONS", group);
}

void settle_conflicts(const DetectorFlags& flags, const BackendFlags& backend) {
    (void)xray_model(flags.xray);
    if (flags.noise_photons) check_photons(*flags.noise_photons);
    if (flags.is_ideal() && !flags.spectrum.empty()) {
        throw Error("--spectrum has no meaning with --xray ideal, which has one energy: name another model");
    }
    if (flags.is_ideal()) return;
    if (backend.step_mm != 0) {
        throw Error("--step has no meaning with --xray " + flags.xray +
                    ", whose X-rays have steps of their own: leave it out");
    }
}

XrayModel detector_model(const DetectorFlags& flags) {
    XrayModel model = xray_model(flags.xray);
    if (flags.spectrum.empty()) return model;
    model.spectrum = read_spectrum(flags.spectrum);
    model.source += "; spectrum of a file";
    check_xray_model(model, flags.spectrum.string());
    return model;
}

IntensitySettings detector_intensity() {
    IntensitySettings settings;
    settings.kind = IntensityKind::transmission;
    settings.polarity = Polarity::bone_dark;
    settings.auto_mask = true;
    return settings;
}

std::vector<XrayExposure> exposures(const XrayModel& model, const DetectorFlags& flags, const Volume& volume,
                                    const VolumeFlags& volume_flags, const std::vector<View>& views,
                                    const RigidTransform& world_from_ct, Projector registers_by) {
    const bool is_hu = !volume_flags.attenuation && !volume_flags.hu_preset.empty();
    const HuPreset& units = is_hu ? hu_preset(volume_flags.hu_preset) : hu_presets().front();
    const auto backend = simulation_backend();
    std::vector<XrayExposure> list = expose(model, volume, units, views, world_from_ct, *backend, registers_by);
    for (XrayExposure& exposure : list) {
        const int samples = exposure.samples_per_pixel * exposure.samples_per_pixel;
        if (flags.noise_photons) exposure.photons_per_sample = *flags.noise_photons / samples;
    }
    return list;
}

void read_counts(View& view, const RawXray& counts) {
    XrayConversion read =
        line_integral_from_xray(counts, view.weights, detector_intensity(), "simulated for view " + view.name);
    view.image = std::move(read.line_integral);
    view.weights = std::move(read.weights);
}

Json xray_model_json(const XrayModel& m) {
    Json spectrum = Json::array();
    for (const SpectrumLine& line : m.spectrum) {
        spectrum.push_back({{"energy_kev", line.energy_kev}, {"weight", line.weight}});
    }
    return {{"name", m.name},
            {"source", m.source},
            {"spectrum", spectrum},
            {"photons_per_mm2", m.photons_per_mm2},
            {"focal_spot_mm", m.focal_spot_mm},
            {"scatter_ratio", m.scatter_ratio},
            {"scatter_near_mm", m.scatter_near_mm},
            {"scatter_far_mm", m.scatter_far_mm},
            {"scatter_far_share", m.scatter_far_share},
            {"blade_share", {m.blade_share.x(), m.blade_share.y()}},
            {"round_field_share", m.round_field_share},
            {"marker_share", m.marker_share},
            {"ramp", m.ramp},
            {"blur_mm", m.blur_mm},
            {"vignetting", m.vignetting},
            {"electronic_noise", m.electronic_noise},
            {"full_scale", m.full_scale},
            {"floor_share", m.floor_share},
            {"bits", m.bits}};
}

}  // namespace raylign::detail::apps
