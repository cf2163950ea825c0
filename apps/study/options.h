#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/shared/articulated.h"
#include "apps/shared/detector.h"
#include "apps/shared/options.h"
#include "raylign/study.h"

namespace raylign::detail::apps {

struct StudyOptions {
    VolumeFlags volume;
    BackendFlags backend;  ///< name, and method's name and metric, may be lists with commas; "" = the preset's
    MethodFlags method;    ///< content and robust weights are the defaults
    TruthFlags truth;
    OutputFlags output;
    std::filesystem::path views;  ///< views.json
    std::string preset;           ///< "" = none
    std::string bins;             ///< "LOW:STEP:HIGH" [mm]; "" = the preset's, or 0:2:20
    static constexpr int kOfPreset = std::numeric_limits<int>::min();
    int per_bin = kOfPreset;             ///< the preset's, or 10
    std::vector<std::string> view_sets;  ///< each names with commas; none = the preset's, or all views together
    DetectorFlags detector;              ///< of simulated X-rays
    ArticulationFlags articulation;      ///< objects that are moved at random in every trial, and registered together
    std::string rest;                    ///< of them: what is registered beside: body, still or none; "" = none
    std::optional<long long> trial;      ///< run this one alone; none = the study
    bool backends_of_preset = false;     ///< set by settled(): backends that cannot run here are left out
};

/// One thing studied. Every case begins at the same starts.
struct StudyCase {
    std::vector<std::string> views;
    std::string backend, method, metric;
    std::string object;  ///< whose success it tells, of several that are registered together; "" = the CT's
};
/// "AP+LAT, cpu, gauss-newton, gc"; of an object with its name and a colon before.
[[nodiscard]] std::string case_label(const StudyCase& study_case);

/// A preset stands for a table of [Ino06]: defaults for what the command line leaves open.
struct StudyPreset {
    std::string name, summary;
    std::vector<std::string> backends;  ///< those that this build and machine lack are left out, and the report says so
    std::string method;
    std::string bins;
    int per_bin;
    double noise_photons;
};
[[nodiscard]] const std::vector<StudyPreset>& study_presets();
[[nodiscard]] std::string preset_names();  ///< "a or b"

/// The options with everything settled: the preset's values where nothing was given, the defaults where there is none.
/// Throws Error for contradictions, unknown presets and values out of range.
[[nodiscard]] StudyOptions settled(StudyOptions options);

/// "0:2:20". Throws Error for another form.
[[nodiscard]] StudyBins parse_bins(const std::string& text);

/// All combinations, views outermost, objects of `--move` innermost. `view_names`: of views.json. Throws Error for
/// unknown views, backends, methods and metrics, and, kind unavailable, for a backend that cannot run here (a preset's
/// goes to `left_out` instead).
[[nodiscard]] std::vector<StudyCase> study_cases(const StudyOptions& options,
                                                 const std::vector<std::string>& view_names,
                                                 const std::vector<std::string>& object_names,
                                                 std::vector<LeftOut>& left_out);

}  // namespace raylign::detail::apps
