#include "apps/register/report.h"

#include <nlohmann/json.hpp>

#include "core/io/files/output.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

using Json = nlohmann::ordered_json;

Json matrix(const RigidTransform& b_from_a) {
    const Eigen::Matrix4d m = to_matrix(b_from_a);
    Json rows = Json::array();
    for (int r = 0; r < 4; ++r) rows.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    return rows;
}

template <typename Vector>
Json triple(const Vector& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

Json inputs(const RegisterRun& run) {
    Json list = Json::array();
    for (const std::filesystem::path& file : run.inputs.files) {
        list.push_back({{"path", file.string()}, {"sha256", sha256_of_file(file)}});
    }
    return list;
}

Json backend(const RegisterRun& run) {
    Json passed_over = Json::array();
    for (const BackendStatus& other : run.passed_over) {
        passed_over.push_back({{"name", other.name}, {"reason", other.reason}});
    }
    return {{"name", run.backend.name},       {"device", run.backend.device},
            {"threads", run.backend.threads}, {"instruction_set", run.backend.instruction_set},
            {"storage", run.backend.storage}, {"interpolation", run.backend.interpolation},
            {"timing", run.backend.timing},   {"passed_over", passed_over}};
}

Json times(const RegisterRun& run) {
    const SessionTiming& engine = run.result.timing;
    return {{"total", run.total_s},          {"load", run.inputs.load_s},          {"prepare", engine.prepare_s},
            {"drr", engine.drr_s},           {"gradient", engine.gradient_s},      {"reduction", engine.reduction_s},
            {"transfer", engine.transfer_s}, {"optimizer", run.result.optimizer_s}};
}

Json levels(const RegistrationResult& result) {
    Json list = Json::array();
    for (const LevelReport& level : result.levels) {
        Json sizes = Json::array();
        for (const Eigen::Vector2i& size : level.image_sizes_px) sizes.push_back({size.x(), size.y()});
        list.push_back({{"volume_size", triple(level.volume_size)},
                        {"spacing_mm", triple(level.spacing_mm)},
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
                        {"world_from_ct", matrix(record.world_from_ct)}});
    }
    return list;
}

Json view_costs(const RegisterRun& run) {
    Json list = Json::array();
    for (std::size_t i = 0; i < run.result.view_costs.size(); ++i) {
        list.push_back({{"name", run.inputs.views[i].name},
                        {"cost", run.result.view_costs[i]},
                        {"overlap", run.result.overlap[i]}});
    }
    return list;
}

Json memory(const RegisterRun& run) {
    std::size_t engine_bytes = 0;
    std::string layout;
    for (const LevelReport& level : run.result.levels) {
        if (level.volume_bytes < engine_bytes) continue;
        engine_bytes = level.volume_bytes;
        layout = level.volume_layout;
    }
    return {{"host_volume_bytes", run.inputs.volume.attenuation_per_mm.size() * sizeof(float)},
            {"engine_volume_bytes", engine_bytes},
            {"engine_volume_layout", layout}};
}

Json errors_against_truth(const RegisterRun& run) {
    return {{"initial_mtre_mm", run.truth->initial.mtre_mm},
            {"final_mtre_mm", run.truth->final.mtre_mm},
            {"final_mrpd_mm", run.truth->final.mean_mrpd_mm},
            {"targets", run.inputs.targets_ct_mm.size()}};
}

Json device_json(const DeviceStatus& device) {
    return {{"index", device.index},
            {"name", device.name},
            {"vendor", device.vendor},
            {"version", device.version},
            {"node", device.node},
            {"software", device.software},
            {"texture_3d_voxels", device.texture_3d_voxels},
            {"texture_layers", device.texture_layers},
            {"memory_bytes", device.memory_bytes},
            {"problem", device.problem}};
}

Json covariance(const Confidence& confidence) {
    if (!confidence.is_estimated) return nullptr;
    Json rows = Json::array();
    for (int r = 0; r < 6; ++r) {
        Json row = Json::array();
        for (int c = 0; c < 6; ++c) row.push_back(confidence.covariance(r, c));
        rows.push_back(row);
    }
    return rows;
}

Json sigma(const Confidence& confidence) {
    if (!confidence.is_estimated) return nullptr;
    return {{"translation_mm", confidence.translation_mm},
            {"rotation_deg", confidence.rotation_deg},
            {"expected_error_mm", confidence.rim_mm},
            {"weakest_direction", triple(confidence.weakest_direction)},
            {"weakest_mm", confidence.weakest_mm}};
}

Json search(const SearchReport& search) {
    Json rivals = Json::array();
    for (const Rival& rival : search.rivals) {
        rivals.push_back({{"cost", rival.cost},
                          {"shift_mm", rival.shift_mm},
                          {"rotation_deg", rival.rotation_deg},
                          {"world_from_ct", matrix(rival.world_from_ct)}});
    }
    return {{"mode", search_name(search.mode)}, {"starts", search.starts}, {"refined", search.refined},
            {"agreeing", search.agreeing},      {"cost", search.cost},     {"rivals", rivals}};
}

std::string text_of(const Json& json) {
    // Names of files and views may hold bytes that are not UTF-8: replaced in the report rather than fatal to the run.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string report_json(const RegisterRun& run) {
    const RegistrationResult& result = run.result;
    Json report = {{"raylign", RAYLIGN_VERSION},
                   {"command", run.invocation.command_line},
                   {"working_directory", std::filesystem::current_path().string()},
                   {"seed", run.options.seed},
                   {"inputs", inputs(run)},
                   {"backend", backend(run)},
                   {"method", method_name(result.method)},
                   {"method_reason", result.method_reason},
                   {"content", content_name(result.content)},
                   {"decisions", result.decisions},
                   {"metric", run.options.metric},
                   {"projector", run.options.engine.projector},
                   {"verdict", {{"ok", result.ok}, {"reasons", result.reasons}}},
                   {"cost", {{"initial", result.cost_initial}, {"final", result.cost_final}}},
                   {"views", view_costs(run)}};
    if (run.truth) report["tre"] = errors_against_truth(run);
    report["world_from_ct"] = matrix(result.world_from_ct);
    report["start_world_from_ct"] = matrix(run.inputs.start_world_from_ct);
    report["covariance"] = covariance(result.confidence);
    report["sigma"] = sigma(result.confidence);
    report["search"] = search(result.search);
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
    return text_of(report);
}

std::string info_json(const std::vector<BackendStatus>& backends) {
    Json list = Json::array();
    for (const BackendStatus& status : backends) {
        Json entry = {{"name", status.name},
                      {"summary", status.summary},
                      {"available", status.available},
                      {"reason", status.reason}};
        if (status.available) {
            entry["device"] = status.info.device;
            entry["threads"] = status.info.threads;
            entry["instruction_set"] = status.info.instruction_set;
        }
        Json devices = Json::array();
        for (const DeviceStatus& device : status.devices) devices.push_back(device_json(device));
        entry["devices"] = devices;
        Json sets = Json::array();
        for (const InstructionSetStatus& set : status.instruction_sets) {
            sets.push_back({{"name", instruction_set_name(set.set)}, {"available", set.available}});
        }
        entry["instruction_sets"] = sets;
        list.push_back(entry);
    }
    return text_of({{"raylign", RAYLIGN_VERSION}, {"backends", list}});
}

}  // namespace raylign::detail::apps
