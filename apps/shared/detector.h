#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/shared/flags.h"
#include "apps/shared/json_text.h"
#include "raylign/xray.h"

namespace raylign::detail::apps {

struct DetectorFlags {
    std::string xray = "ideal";           ///< name of an X-ray model
    std::filesystem::path spectrum;       ///< in place of the model's own; "" = none
    std::optional<double> noise_photons;  ///< of an unattenuated pixel, 0 = no noise; none = the model's own
    [[nodiscard]] bool is_ideal() const { return xray == "ideal"; }
};
/// --xray, --spectrum and --noise.
void add_detector_flags(CLI::App& command, DetectorFlags& flags, const char* group);

/// Throws Error for an unknown model, photons out of range, a spectrum of the ideal model and flags of the backend that
/// X-rays of a model would not heed.
void settle_conflicts(const DetectorFlags& flags, const BackendFlags& backend);

/// How a detector's counts are to be read, here and from files: transmission, bone dark, fields and letters masked.
[[nodiscard]] IntensitySettings detector_intensity();

/// The model by its name, with the spectrum of the file: a table of keV and photons, whose sum becomes 1. Throws Error
/// for a file that is no such table.
[[nodiscard]] XrayModel detector_model(const DetectorFlags& flags);

/// expose() by the cpu backend where this build has it, with the photons that the flags ask for.
[[nodiscard]] std::vector<XrayExposure> exposures(const XrayModel& model, const DetectorFlags& flags,
                                                  const Volume& volume, const VolumeFlags& volume_flags,
                                                  const std::vector<View>& views, const RigidTransform& world_from_ct,
                                                  Projector registers_by);

/// Image and weights of the view as who reads these counts from a file sees them.
void read_counts(View& view, const RawXray& counts);

/// The model's values for reports.
[[nodiscard]] Json xray_model_json(const XrayModel& model);

}  // namespace raylign::detail::apps
