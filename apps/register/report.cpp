#include "apps/register/report.h"

#include "apps/shared/manifest.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

Json times(const RegisterRun& run) {
    const SessionTiming& backend = run.result.timing;
    return {{"total", run.total_s},           {"load", run.inputs.load_s},          {"prepare", backend.prepare_s},
            {"drr", backend.drr_s},           {"gradient", backend.gradient_s},     {"reduction", backend.reduction_s},
            {"transfer", backend.transfer_s}, {"optimizer", run.result.optimizer_s}};
}

Json levels(const RegistrationResult& result) {
    Json list = Json::array();
    for (const LevelReport& level : result.levels) {
        Json sizes = Json::array();
        for (const Eigen::Vector2i& size : level.image_sizes_px) sizes.push_back({size.x(), size.y()});
        list.push_back({{"volume_size", vector_json(level.volume_size)},
                        {"spacing_mm", vector_json(level.spacing_mm)},
                        {"image_sizes_px", sizes},
                        {"content", content_name(level.content)},
                        {"filter", {{"sigma_px", level.filter.sigma_px}, {"radius_px", level.filter.radius_px}}},
                        {"cost", {{"initial", level.cost_initial}, {"final", level.cost_final}}},
                        {"iterations", level.iterations},
                        {"evaluations", level.evaluations},
                        {"linearizations", level.linearizations},
                        {"termination", termination_name(level.termination)},
                        {"engine_volume_bytes", level.volume_bytes},
                        {"engine_volume_layout", level.volume_layout},
                        {"time_s", level.time_s}});
    }
    return list;
}

Json history(const RegistrationResult& result) {
    Json list = Json::array();
    for (const IterationRecord& record : result.history) {
        list.push_back({{"level", record.level},
                        {"iteration", record.iteration},
                        {"cost", record.cost},
                        {"step_mm", record.step_mm},
                        {"world_from_ct", matrix_json(record.world_from_ct)}});
    }
    return list;
}

Json correction(const ViewCorrection& correction) {
    if (!correction.is_estimated) return nullptr;
    return {{"rotation_deg", vector_json(correction.rotation_deg)},
            {"translation_mm", vector_json(correction.translation_mm)},
            {"rotation_sigma_deg", vector_json(correction.rotation_sigma_deg)},
            {"translation_sigma_mm", vector_json(correction.translation_sigma_mm)},
            {"centre_world_mm", vector_json(correction.centre_world_mm)},
            {"significance", correction.significance},
            {"effect_mm", correction.effect_mm},
            {"applied", correction.is_applied},
            {"doubtful", correction.is_doubtful}};
}

Json view_costs(const RegisterRun& run) {
    Json list = Json::array();
    for (std::size_t i = 0; i < run.result.view_costs.size(); ++i) {
        list.push_back({{"name", run.inputs.views[i].name},
                        {"cost", run.result.view_costs[i]},
                        {"overlap", run.result.overlap[i]},
                        {"correction", correction(run.result.views[i].correction)},
                        {"camera_from_world", matrix_json(run.result.views[i].camera_from_world)}});
    }
    return list;
}

Json memory(const RegisterRun& run) {
    std::size_t backend_bytes = 0;
    std::string layout;
    for (const LevelReport& level : run.result.levels) {
        if (level.volume_bytes < backend_bytes) continue;
        backend_bytes = level.volume_bytes;
        layout = level.volume_layout;
    }
    return {{"host_volume_bytes", run.inputs.volume.attenuation_per_mm.size() * sizeof(float)},
            {"engine_volume_bytes", backend_bytes},
            {"engine_volume_layout", layout}};
}

Json errors_against_truth(const RegisterRun& run) {
    return {{"initial_mtre_mm", run.truth->initial.mtre_mm},
            {"final_mtre_mm", run.truth->final.mtre_mm},
            {"final_mrpd_mm", run.truth->final.mean_mrpd_mm},
            {"targets", run.inputs.targets_ct_mm.size()}};
}

}  // namespace

Json covariance_json(const Confidence& confidence) {
    if (!confidence.is_estimated) return nullptr;
    return matrix_json(confidence.covariance);
}

Json sigma_json(const Confidence& confidence) {
    if (!confidence.is_estimated) return nullptr;
    Json sigma = {
        {"translation_mm", confidence.translation_mm}, {"rotation_deg", confidence.rotation_deg},
        {"expected_error_mm", confidence.rim_mm},      {"weakest_direction", vector_json(confidence.weakest_direction)},
        {"weakest_mm", confidence.weakest_mm},         {"weakest_axis", vector_json(confidence.weakest_axis)},
        {"weakest_deg", confidence.weakest_deg}};
    const bool one_view = confidence.in_depth_mm > 0;
    sigma["in_plane_mm"] = one_view ? Json(confidence.in_plane_mm) : Json();
    sigma["in_depth_mm"] = one_view ? Json(confidence.in_depth_mm) : Json();
    return sigma;
}

Json search_json(const SearchReport& search) {
    Json rivals = Json::array();
    for (const Rival& rival : search.rivals) {
        rivals.push_back({{"cost", rival.cost},
                          {"shift_mm", rival.shift_mm},
                          {"rotation_deg", rival.rotation_deg},
                          {"world_from_ct", matrix_json(rival.world_from_ct)}});
    }
    return {{"mode", search_name(search.mode)}, {"starts", search.starts}, {"refined", search.refined},
            {"agreeing", search.agreeing},      {"cost", search.cost},     {"rivals", rivals}};
}

std::string report_json(const RegisterRun& run) {
    const RegistrationResult& result = run.result;
    Json report = {{"raylign", RAYLIGN_VERSION},
                   {"command", run.invocation.command_line},
                   {"working_directory", std::filesystem::current_path().string()},
                   {"seed", run.options.method.seed},
                   {"inputs", inputs_json(run.inputs.hashes)},
                   {"backend", backend_json(run.backend, run.passed_over)},
                   {"method", method_name(result.method)},
                   {"method_reason", result.method_reason},
                   {"content", content_name(result.content)},
                   {"decisions", result.decisions},
                   {"metric", run.options.method.metric},
                   {"projector", run.options.backend.projector},
                   {"verdict", {{"ok", result.ok}, {"reasons", result.reasons}}},
                   {"cost", {{"initial", result.cost_initial}, {"final", result.cost_final}}},
                   {"views", view_costs(run)}};
    if (run.truth) report["tre"] = errors_against_truth(run);
    report["world_from_ct"] = matrix_json(result.world_from_ct);
    report["start_world_from_ct"] = matrix_json(run.inputs.start_world_from_ct);
    report["covariance"] = covariance_json(result.confidence);
    report["sigma"] = sigma_json(result.confidence);
    report["search"] = search_json(result.search);
    report["robust_rounds"] = result.robust_rounds;
    report["iterations"] = result.iterations;
    report["evaluations"] = result.counters.evaluations;
    report["linearizations"] = result.counters.linearizations;
    report["bytes_to_host"] = result.counters.bytes_to_host;
    report["time_s"] = times(run);
    report["memory"] = memory(run);
    report["notes"] = run.inputs.notes;
    report["outputs"] = run.outputs;
    report["levels"] = levels(result);
    report["history"] = history(result);
    return indented(report);
}

std::string register_page(const std::string& report, const std::vector<PageOverlay>& overlays,
                          const PageScript& viewer) {
    return report_page("register", report, overlays, {{"machine", one_line(machine_json())}}, viewer);
}

}  // namespace raylign::detail::apps
