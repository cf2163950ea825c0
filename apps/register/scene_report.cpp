#include "apps/register/scene_report.h"

#include <cmath>
#include <numbers>

#include "apps/register/report.h"
#include "apps/shared/lines.h"
#include "apps/shared/manifest.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/registration/object/pose_space.h"
#include "raylign/targets.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

constexpr double kDegreesPerRad = 180 / std::numbers::pi;

std::vector<ViewGeometry> geometries_of(const SceneInputs& inputs) {
    std::vector<ViewGeometry> geometries;
    for (const View& view : inputs.views) geometries.push_back(view.geometry);
    return geometries;
}

Json object_tre(const SceneInput& object, const RegistrationResult& result, const SceneInputs& inputs) {
    const auto errors = [&](const RigidTransform& world_from_ct) {
        return target_errors(world_from_ct, *object.true_world_from_ct, object.targets_ct_mm, geometries_of(inputs));
    };
    const TargetErrors final = errors(result.world_from_ct);
    return {{"initial_mtre_mm", errors(object.start_world_from_ct).mtre_mm},
            {"final_mtre_mm", final.mtre_mm},
            {"final_mrpd_mm", final.mean_mrpd_mm},
            {"targets", object.targets_ct_mm.size()}};
}

Json object_views(const RegistrationResult& result, const SceneInputs& inputs) {
    Json list = Json::array();
    for (std::size_t i = 0; i < result.view_costs.size(); ++i) {
        list.push_back(
            {{"name", inputs.views[i].name}, {"cost", result.view_costs[i]}, {"overlap", result.overlap[i]}});
    }
    return list;
}

Json cost_json(double initial, double final) {
    const auto or_none = [](double cost) { return std::isfinite(cost) ? Json(cost) : Json(nullptr); };
    return {{"initial", or_none(initial)}, {"final", or_none(final)}};
}

Json object_json(const SceneInput& object, const RegistrationResult& result, const SceneInputs& inputs) {
    Json json = {{"name", object.name},
                 {"moves", object.mobility == Mobility::moves},
                 {"verdict", {{"ok", result.ok}, {"reasons", result.reasons}}},
                 {"cost", cost_json(result.cost_initial, result.cost_final)},
                 {"views", object_views(result, inputs)},
                 {"world_from_ct", matrix_json(result.world_from_ct)},
                 {"start_world_from_ct", matrix_json(object.start_world_from_ct)},
                 {"covariance", covariance_json(result.confidence)},
                 {"sigma", sigma_json(result.confidence)},
                 {"search", search_json(result.search)},
                 {"time_s", result.total_s}};
    if (object.true_world_from_ct) json["tre"] = object_tre(object, result, inputs);
    return json;
}

CardanSequence sequence_of(const SceneRun& run) {
    const std::string& name = run.options.scene.cardan;
    return CardanSequence::from_name(name.empty() ? "XYZ" : name);
}

Json joints_json(const SceneRun& run) {
    Json list = Json::array();
    const CardanSequence sequence = sequence_of(run);
    for (const SceneJoint& joint : scene_joints(run, sequence)) {
        list.push_back({{"proximal", joint.proximal},
                        {"distal", joint.distal},
                        {"sequence", sequence.name()},
                        {"angles_deg", vector_json(Eigen::Vector3d(joint.angles_rad * kDegreesPerRad))},
                        {"translation_mm", vector_json(joint.proximal_from_distal.translation_mm)}});
        if (!joint.limit) continue;
        list.back()["limit"] = {{"apart_mm", joint.limit->apart_mm},
                                {"turned_deg", joint.limit->turned_deg},
                                {"used", joint.outcome.is_used}};
        list.back()["since_ct"] = {{"apart_mm", joint.outcome.motion.shift_mm.norm()},
                                   {"turned_deg", joint.outcome.motion.turn_rad.norm() * kDegreesPerRad}};
    }
    return list;
}

Json collisions_json(const SceneRun& run) {
    Json list = Json::array();
    for (const Collision& collision : run.collisions) {
        list.push_back(
            {{"objects", {run.inputs.objects[collision.first].name, run.inputs.objects[collision.second].name}},
             {"voxels", collision.voxels},
             {"volume_mm3", collision.volume_mm3},
             {"share", collision.share}});
    }
    return list;
}

std::string joint_line(const SceneJoint& joint, const CardanSequence& sequence) {
    const Eigen::Vector3d deg = joint.angles_rad * kDegreesPerRad;
    std::string text = joint.proximal + ", " + joint.distal + ": " + fixed(deg[0], 2) + ", " + fixed(deg[1], 2) + ", " +
                       fixed(deg[2], 2) + " deg (" + sequence.name() + ")";
    if (joint.limit) {
        text += ", since the CT parted by " + fixed(joint.outcome.motion.shift_mm.norm(), 2) + " mm and turned by " +
                fixed(joint.outcome.motion.turn_rad.norm() * kDegreesPerRad, 2) + " deg";
        if (!joint.outcome.is_used) text += " (its limit was not used)";
    }
    return line("joint", text);
}

std::string object_line(const SceneInput& object, const RegistrationResult& result) {
    if (object.mobility == Mobility::stays) return line(object.name, "stays");
    std::string text = result.ok ? "ok" : "DOUBTFUL: " + joined(result.reasons, "; ");
    if (std::isfinite(result.cost_final)) text += ", cost " + fixed(result.cost_final, 4);
    if (result.confidence.is_estimated) text += ", expected error " + fixed(result.confidence.rim_mm, 3) + " mm";
    const RigidTransform moved = result.world_from_ct * inverse(object.start_world_from_ct);
    const Eigen::Vector3d centre = object.start_world_from_ct * object.volume.grid.centre_ct_mm();
    text += ", moved " + fixed((moved * centre - centre).norm(), 2) + " mm and turned " +
            fixed(rotation_angle_rad(moved) * kDegreesPerRad, 2) + " deg";
    if (object.true_world_from_ct) {
        const auto error_mm = [&](const RigidTransform& pose) {
            return mean_target_error_mm(pose, *object.true_world_from_ct, object.targets_ct_mm);
        };
        text += ", mTRE " + fixed(error_mm(object.start_world_from_ct), 3) + " mm -> " +
                fixed(error_mm(result.world_from_ct), 3) + " mm";
    }
    return line(object.name, text);
}

}  // namespace

std::vector<std::string> all_reasons(const SceneRun& run) {
    std::vector<std::string> reasons;
    for (std::size_t k = 0; k < run.inputs.objects.size(); ++k) {
        for (const std::string& reason : run.result.objects[k].reasons) {
            reasons.push_back(run.inputs.objects[k].name + ": " + reason);
        }
    }
    return reasons;
}

std::vector<SceneJoint> scene_joints(const SceneRun& run, const CardanSequence& sequence) {
    const auto world_from_axes = [&](std::size_t k) {
        const Eigen::Vector3d centre = object_extent(run.inputs.objects[k].volume).centre_ct_mm;
        return run.result.objects[k].world_from_ct * RigidTransform::translate(centre);
    };
    std::vector<SceneJoint> joints;
    std::size_t limits = 0;
    for (const AskedJoint& ends : run.inputs.joints) {
        const RigidTransform proximal_from_distal =
            inverse(world_from_axes(ends.proximal)) * world_from_axes(ends.distal);
        joints.push_back({run.inputs.objects[ends.proximal].name, run.inputs.objects[ends.distal].name,
                          proximal_from_distal, cardan_angles_rad(proximal_from_distal.rotation, sequence)});
        if (!(ends.apart_mm > 0)) continue;
        joints.back().limit = run.inputs.limits[limits];
        joints.back().outcome = run.result.joints[limits++];
    }
    return joints;
}

std::string scene_json(const SceneRun& run) {
    const SceneResult& result = run.result;
    Json objects = Json::array();
    for (std::size_t k = 0; k < run.inputs.objects.size(); ++k) {
        objects.push_back(object_json(run.inputs.objects[k], result.objects[k], run.inputs));
    }
    const Json report = {{"raylign", RAYLIGN_VERSION},
                         {"command", run.invocation.command_line},
                         {"working_directory", std::filesystem::current_path().string()},
                         {"seed", run.options.method.seed},
                         {"inputs", inputs_json(run.inputs.hashes)},
                         {"backend", backend_json(run.backend, run.passed_over)},
                         {"method", method_name(Method::gauss_newton)},
                         {"metric", run.options.method.metric},
                         {"projector", run.options.backend.projector},
                         {"verdict", {{"ok", result.ok}, {"reasons", all_reasons(run)}}},
                         {"cost", cost_json(result.cost_initial, result.cost_final)},
                         {"iterations", result.iterations},
                         {"decisions", result.decisions},
                         {"objects", objects},
                         {"joints", joints_json(run)},
                         {"collisions", collisions_json(run)},
                         {"time_s",
                          {{"total", run.total_s},
                           {"load", run.inputs.load_s},
                           {"together", result.together_s},
                           {"registration", result.total_s}}},
                         {"notes", run.inputs.notes},
                         {"outputs", run.outputs}};
    return indented(report);
}

std::string scene_summary(const SceneRun& run) {
    std::string text = line("verdict", run.result.ok ? "ok" : "DOUBTFUL: look at the objects");
    for (std::size_t k = 0; k < run.inputs.objects.size(); ++k) {
        text += object_line(run.inputs.objects[k], run.result.objects[k]);
    }
    const CardanSequence sequence = sequence_of(run);
    for (const SceneJoint& joint : scene_joints(run, sequence)) text += joint_line(joint, sequence);
    for (const Collision& collision : run.collisions) {
        text += line("collision", run.inputs.objects[collision.first].name + " and " +
                                      run.inputs.objects[collision.second].name + " share " +
                                      fixed(collision.volume_mm3 / 1000, 2) + " cm3, " +
                                      fixed(100 * collision.share, 1) + " % of the smaller one");
    }
    text += line("together", "cost " + fixed(run.result.cost_initial, 4) + " -> " + fixed(run.result.cost_final, 4) +
                                 ", " + std::to_string(run.result.iterations) + " iterations, " +
                                 fixed(run.result.together_s, 2) + " s");
    for (const std::string& decision : run.result.decisions) text += line("decided", decision);
    text += line("all", fixed(run.total_s, 2) + " s, of which reading " + fixed(run.inputs.load_s, 2) + " s");
    text += line("backend", run.backend.name + ": " + run.backend.device);
    for (const BackendStatus& other : run.passed_over) text += line("not used", other.name + ": " + other.reason);
    for (const std::string& note : run.inputs.notes) text += line("note", note);
    return text + line("written", run.options.output.folder.string() + ": " + joined(run.outputs, " "));
}

}  // namespace raylign::detail::apps
