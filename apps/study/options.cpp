#include "apps/study/options.h"

#include <algorithm>
#include <locale>
#include <sstream>

#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace raylign::detail::apps {
namespace {

constexpr int kMostPerBin = 100000;

const StudyPreset& preset_named(const std::string& name) {
    const auto found = std::ranges::find(study_presets(), name, &StudyPreset::name);
    if (found == study_presets().end()) throw bad_value("--preset", name, preset_names());
    return *found;
}

/// Each view alone, then all together: the paper's single view and biplane.
std::vector<std::string> single_and_all(const std::vector<std::string>& view_names) {
    std::vector<std::string> sets{view_names.front()};
    if (view_names.size() > 1) sets.push_back(joined(view_names, ","));
    return sets;
}

std::vector<std::string> views_of_set(const std::string& set, const std::vector<std::string>& view_names) {
    std::vector<std::string> views = parse_list(set, "--view");
    for (const std::string& view : views) {
        if (std::ranges::find(view_names, view) != view_names.end()) continue;
        throw bad_value("--view", view, "one of " + joined(view_names));
    }
    return views;
}

/// Software OpenGL is no GPU: a preset takes it only where --backend names it.
void need_hardware(const std::string& name, const BackendFlags& flags) {
    if (name.rfind("gl", 0) != 0) return;
    BackendFlags automatic = flags;
    automatic.name = "auto";
    automatic.reduction.clear();
    const BackendChoice choice = choose_backend(automatic);
    if (choice.backend->info().name.rfind("gl", 0) == 0) return;
    std::string reason = "no hardware GPU can run here";
    for (const BackendStatus& other : choice.passed_over) reason += "; " + other.name + ": " + other.reason;
    throw Error(reason, ErrorKind::unavailable);
}

/// The backends that run here, by the names they were asked for ("auto" by the name of what it takes).
std::vector<std::string> usable_backends(const StudyOptions& options, std::vector<LeftOut>& left_out) {
    std::vector<std::string> usable;
    for (const std::string& name : parse_list(options.backend.name, "--backend")) {
        const BackendFlags flags = with_backend(options.backend, name);
        settle_conflicts(flags);
        try {
            if (options.backends_of_preset) need_hardware(name, flags);
            const std::string backend = choose_backend(flags).backend->info().name;
            usable.push_back(name == "auto" ? backend : name);
        } catch (const Error& error) {
            if (!options.backends_of_preset) throw;
            left_out.push_back({name, error.what()});
        }
    }
    if (usable.empty()) throw Error("no backend of the preset can run here", ErrorKind::unavailable);
    std::vector<std::string> once;
    for (const std::string& name : usable) {
        if (std::ranges::find(once, name) == once.end()) once.push_back(name);
    }
    return once;
}

}  // namespace

std::string preset_names() {
    std::vector<std::string> names;
    for (const StudyPreset& preset : study_presets()) names.push_back(preset.name);
    return joined(names, " or ");
}

std::string case_label(const StudyCase& study_case) {
    return (study_case.object.empty() ? "" : study_case.object + ": ") + joined(study_case.views, "+") + ", " +
           study_case.backend + ", " + study_case.method + ", " + study_case.metric;
}

const std::vector<StudyPreset>& study_presets() {
    static const std::vector<StudyPreset> presets{
        {"paper-table3",
         "single view against all views, on CPU and GPU: ten starts an interval, steepest descent",
         {"gl", "gl-2006", "cpu"},
         "steepest-descent",
         "0:2:20",
         10,
         20000},
        {"paper-table4",
         "sums read back exactly against sums by mipmaps: ten starts an interval, steepest descent",
         {"gl-2006", "gl-2006-mipmap", "cpu"},
         "steepest-descent",
         "0:2:20",
         10,
         20000}};
    return presets;
}

namespace {

/// What several objects at once leave no room for.
void settle_objects(const StudyOptions& options) {
    settle_conflicts(options.articulation, options.volume);
    const std::string& rest = options.rest;
    if (rest != "" && rest != "body" && rest != "still" && rest != "none") {
        throw bad_value("--rest", rest, "body, still or none");
    }
    if (options.articulation.moves.empty()) {
        if (!rest.empty()) throw Error("--rest has no meaning without --move");
        return;
    }
    for (const std::string& move : options.articulation.moves) {
        if (move.find('=') != std::string::npos) {
            throw Error("--move " + move + ": in a study objects move at random, a pose has no meaning");
        }
    }
    if (!options.truth.targets.empty()) throw Error("--targets is for one object: leave it out with --move");
    for (const std::string& method : parse_list(options.method.name, "--method")) {
        if (method == "auto" || method == "gauss-newton") continue;
        throw bad_value("--method with --move", method, "auto or gauss-newton");
    }
}

}  // namespace

StudyOptions settled(StudyOptions options) {
    if (!options.preset.empty()) {
        const StudyPreset& preset = preset_named(options.preset);
        if (options.bins.empty()) options.bins = preset.bins;
        if (options.per_bin == StudyOptions::kOfPreset) options.per_bin = preset.per_bin;
        if (options.backend.name.empty()) {
            options.backend.name = joined(preset.backends, ",");
            options.backends_of_preset = true;
        }
        if (options.method.name.empty()) options.method.name = preset.method;
        // What the preset says is the ideal detector's.
        if (!options.detector.noise_photons && options.detector.is_ideal()) {
            options.detector.noise_photons = preset.noise_photons;
        }
    }
    if (options.bins.empty()) options.bins = "0:2:20";
    if (options.per_bin == StudyOptions::kOfPreset) options.per_bin = 10;
    if (options.backend.name.empty()) options.backend.name = "auto";
    if (options.method.name.empty()) options.method.name = "auto";
    if (options.method.metric.empty()) options.method.metric = "gc";
    if (!options.detector.noise_photons && options.detector.is_ideal()) options.detector.noise_photons = 0;

    settle_objects(options);
    settle_conflicts(options.volume);
    settle_conflicts(options.backend);
    if (options.per_bin < 1 || options.per_bin > kMostPerBin) {
        throw bad_value("--per-bin", std::to_string(options.per_bin), "in [1, 100000]");
    }
    settle_conflicts(options.detector, options.backend);
    (void)study_intervals(parse_bins(options.bins));
    return options;
}

StudyBins parse_bins(const std::string& text) {
    const Error problem = bad_value("--bins", text, "LOW:STEP:HIGH in mm, as in 0:2:20");
    std::istringstream stream(text);
    stream.imbue(std::locale::classic());
    StudyBins bins;
    char first = 0, second = 0;
    if (!(stream >> bins.low_mm >> first >> bins.step_mm >> second >> bins.high_mm)) throw problem;
    if (first != ':' || second != ':' || stream.peek() != std::char_traits<char>::eof()) throw problem;
    return bins;
}

std::vector<StudyCase> study_cases(const StudyOptions& options, const std::vector<std::string>& view_names,
                                   const std::vector<std::string>& object_names, std::vector<LeftOut>& left_out) {
    std::vector<std::string> sets = options.view_sets;
    if (sets.empty()) {
        sets = options.preset.empty() ? std::vector<std::string>{joined(view_names, ",")} : single_and_all(view_names);
    }
    const std::vector<std::string> methods = parse_list(options.method.name, "--method");
    const std::vector<std::string> metrics = parse_list(options.method.metric, "--metric");
    for (const std::string& method : methods) (void)method_from_name(method);
    for (const std::string& metric : metrics) (void)metric_from_name(metric);
    const std::vector<std::string> backends = usable_backends(options, left_out);
    std::vector<StudyCase> cases;
    for (const std::string& set : sets) {
        const std::vector<std::string> views = views_of_set(set, view_names);
        for (const std::string& method : methods) {
            for (const std::string& metric : metrics) {
                for (const std::string& backend : backends) {
                    for (const std::string& object : object_names) {
                        cases.push_back({views, backend, method, metric, object});
                    }
                }
            }
        }
    }
    return cases;
}

}  // namespace raylign::detail::apps
