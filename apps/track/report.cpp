#include "apps/track/report.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>

#include "apps/shared/interrupt.h"
#include "apps/shared/lines.h"
#include "apps/shared/manifest.h"
#include "core/base/error.h"
#include "core/base/fault_text.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/io/files/output.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

constexpr std::array kStatuses{TrackStatus::ok, TrackStatus::doubtful, TrackStatus::lost, TrackStatus::missing};

/// {p50, p95, max} of a number of the frames with a pose.
Json spread(const std::vector<const TrackFrame*>& frames, double TrackFrame::*number) {
    std::vector<double> values;
    for (const TrackFrame* frame : frames) {
        if (pose_of(*frame)) values.push_back(frame->*number);
    }
    if (values.empty()) return nullptr;
    std::ranges::sort(values);
    const auto at = [&](double share) {
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    return {{"p50", at(0.5)}, {"p95", at(0.95)}, {"max", values.back()}};
}

long long count(const std::vector<const TrackFrame*>& frames, TrackStatus status) {
    return std::ranges::count_if(frames, [&](const TrackFrame* frame) { return frame->status == status; });
}

/// Place of the object's centre and rotation vector since the first pose: what the page draws.
Json frame_json(const TrackFrame& frame, const TrackObject& object, std::optional<RigidTransform>& first) {
    Json json{{"frame", frame.frame}, {"status", status_name(frame.status)}};
    if (const auto pose = pose_of(frame)) {
        if (!first) first = pose;
        const Eigen::Vector3d centre = object.volume.grid.centre_ct_mm();
        json["moved_mm"] = vector_json(Eigen::Vector3d(*pose * centre - *first * centre));
        json["turned_deg"] =
            vector_json(Eigen::Vector3d(log(*pose * inverse(*first)).head<3>() * (180 / std::numbers::pi)));
        json["cost"] = frame.cost;
        json["jump_mm"] = frame.jump_mm;
        json["expected_error_mm"] = frame.expected_error_mm;
        const bool one_view = frame.expected_in_depth_mm > 0;
        json["expected_in_plane_mm"] = one_view ? Json(frame.expected_in_plane_mm) : Json();
        json["expected_in_depth_mm"] = one_view ? Json(frame.expected_in_depth_mm) : Json();
        json["expected_turn_deg"] = frame.expected_turn_deg;
    }
    json["searched"] = search_name(frame.searched);
    json["recovered"] = frame.recovered;
    json["quick"] = frame.quick;
    json["time_s"] = frame.time_s;
    if (!frame.reasons.empty()) json["reasons"] = frame.reasons;
    return json;
}

Json object_json(const TrackReport& report, const TrackObject& object) {
    const auto frames = frames_of(report.record.rows, object.name);
    Json json{{"name", object.name},
              {"volume_size", vector_json(object.volume.grid.size)},
              {"spacing_mm", vector_json(object.volume.grid.spacing_mm)}};
    for (const TrackStatus status : kStatuses)
        json["frames_by_status"][std::string(status_name(status))] = count(frames, status);
    const TrackJitter& jitter = report.jitters[static_cast<std::size_t>(&object - report.inputs.objects.data())];
    json["jitter"] = {{"translation_mm", jitter.translation_mm}, {"rotation_deg", jitter.rotation_deg}};
    json["searched"] = std::ranges::count_if(frames, [](const TrackFrame* f) { return f->searched != Search::none; });
    json["recovered"] = std::ranges::count_if(frames, [](const TrackFrame* f) { return f->recovered; });
    json["quick"] = std::ranges::count_if(frames, [](const TrackFrame* f) { return f->quick; });
    json["cost"] = spread(frames, &TrackFrame::cost);
    json["jump_mm"] = spread(frames, &TrackFrame::jump_mm);
    json["expected_error_mm"] = spread(frames, &TrackFrame::expected_error_mm);
    json["time_s"] = spread(frames, &TrackFrame::time_s);
    std::optional<RigidTransform> first;
    for (const TrackFrame* frame : frames) json["frames"].push_back(frame_json(*frame, object, first));
    return json;
}

Json joint_json(const TrackReport& report, std::size_t joint) {
    const auto [proximal, distal] = report.inputs.joints[joint];
    Json json{{"proximal", report.inputs.objects[proximal].name},
              {"distal", report.inputs.objects[distal].name},
              {"sequence", report.options.cardan}};
    for (const JointRow& row : report.joints[joint]) {
        Json entry{{"frame", row.frame}, {"status", status_name(row.status)}};
        if (row.proximal_from_distal) {
            entry["angles_deg"] = vector_json(Eigen::Vector3d(row.angles_rad * (180 / std::numbers::pi)));
            entry["translation_mm"] = vector_json(row.proximal_from_distal->translation_mm);
        }
        json["frames"].push_back(entry);
    }
    return json;
}

std::string stop_text(const TrackReport& report) {
    if (report.complete()) return "";
    try {
        std::rethrow_exception(report.record.stopped_by);
    } catch (const Interrupted&) {
        return "interrupted";
    } catch (const std::exception& failure) {
        return fault_text(failure);
    }
}

/// Which frames could not be tracked, and why: a line each, so that nobody need look for them in a table.
std::string gap_lines(const TrackReport& report) {
    constexpr std::size_t kMost = 10;
    std::map<int, std::string> reasons;  // the objects share the frame's fault
    for (const TrajectoryRow& row : report.record.rows) {
        if (row.frame.status == TrackStatus::missing) reasons[row.frame.frame] = joined(row.frame.reasons, "; ");
    }
    std::string text;
    std::size_t shown = 0;
    for (const auto& [frame, reason] : reasons) {
        if (++shown > kMost) break;
        text += line("missing", "frame " + std::to_string(frame) + ": " + reason);
    }
    if (reasons.size() > kMost) {
        text += line("missing", std::to_string(reasons.size() - kMost) + " more, see trajectory.csv");
    }
    return text;
}

std::vector<std::string> verdict_reasons(const TrackReport& report) {
    std::vector<std::string> reasons;
    if (!report.complete()) {
        reasons.push_back("ended after " + std::to_string(report.record.instants) + " of " +
                          std::to_string(report.inputs.frames.size()) + " frames: " + stop_text(report));
    }
    for (const TrackObject& object : report.inputs.objects) {
        const auto frames = frames_of(report.record.rows, object.name);
        for (const TrackStatus status : {TrackStatus::doubtful, TrackStatus::lost, TrackStatus::missing}) {
            const long long found = count(frames, status);
            if (found == 0) continue;
            reasons.push_back(object.name + ": " + std::to_string(found) + " of " + std::to_string(frames.size()) +
                              " frames " + std::string(status_name(status)));
        }
    }
    return reasons;
}

double frames_per_second(const TrackReport& report) {
    const double wall_s = report.record.read_s + report.record.track_s;
    return wall_s > 0 ? static_cast<double>(report.record.instants) / wall_s : 0;
}

/// "0.042 mm, 0.05 deg", or with one view "0.13 mm in plane, 1.46 mm in depth, 0.25 deg".
std::string expected_words(const std::vector<const TrackFrame*>& frames) {
    const auto middle = [&](double TrackFrame::*member) {
        const Json all = spread(frames, member);
        return all["p50"].get<double>();
    };
    const std::string turn = ", " + fixed(middle(&TrackFrame::expected_turn_deg), 3) + " deg";
    if (!(middle(&TrackFrame::expected_in_depth_mm) > 0)) {
        return fixed(middle(&TrackFrame::expected_error_mm), 3) + " mm" + turn;
    }
    return fixed(middle(&TrackFrame::expected_in_plane_mm), 3) + " mm in plane, " +
           fixed(middle(&TrackFrame::expected_in_depth_mm), 2) + " mm in depth" + turn;
}

}  // namespace

std::string TrackReport::joint_name(std::size_t joint) const {
    return inputs.objects[inputs.joints[joint].first].name + "_" + inputs.objects[inputs.joints[joint].second].name;
}

bool TrackReport::ok() const {
    return complete() && std::ranges::all_of(
                             record.rows, [](const TrajectoryRow& row) { return row.frame.status == TrackStatus::ok; });
}

std::string track_json(const TrackReport& report) {
    const TrackInputs& inputs = report.inputs;
    Json backend = backend_json(report.backend);
    backend["passed_over"] = passed_over_json(report.passed_over);
    Json json{{"raylign", RAYLIGN_VERSION},
              {"command", report.invocation.command_line},
              {"inputs", inputs_json(report.hashed)},
              {"backend", backend},
              {"machine", machine_json()},
              {"seed", report.options.method.seed},
              {"verdict", {{"ok", report.ok()}, {"reasons", verdict_reasons(report)}}},
              {"complete", report.complete()},
              {"frames",
               {{"first", inputs.frames.front().number},
                {"last", inputs.frames.back().number},
                {"planned", inputs.frames.size()},
                {"done", report.record.instants},
                {"step", inputs.frame_step}}},
              {"views", inputs.view_names()},
              {"frames_per_second", frames_per_second(report)},
              {"time_s",
               {{"total", report.total_s},
                {"load", inputs.load_s},
                {"read_frames", report.record.read_s},
                {"track", report.record.track_s}}},
              {"recover", report.options.recover},
              {"together", inputs.is_together},
              {"notes", report.notes}};
    for (const TrackObject& object : inputs.objects) json["objects"].push_back(object_json(report, object));
    json["joints"] = Json::array();
    for (std::size_t j = 0; j < report.joints.size(); ++j) json["joints"].push_back(joint_json(report, j));
    return indented(json);
}

std::string track_summary(const TrackReport& report) {
    std::string text = report.ok() ? "tracked\n" : "DOUBTFUL: look at the flagged frames\n";
    for (const std::string& reason : verdict_reasons(report)) text += line("why", reason);
    text += gap_lines(report);
    for (const TrackObject& object : report.inputs.objects) {
        const auto frames = frames_of(report.record.rows, object.name);
        const Json error = spread(frames, &TrackFrame::expected_error_mm);
        std::string words = object.name + ": " + std::to_string(count(frames, TrackStatus::ok)) + " of " +
                            std::to_string(frames.size()) + " frames ok";
        if (!error.is_null()) words += ", expected error " + expected_words(frames) + " (medians)";
        const TrackJitter& jitter = report.jitters[static_cast<std::size_t>(&object - report.inputs.objects.data())];
        if (jitter.count > 0) {
            words += ", jitter " + fixed(jitter.translation_mm, 3) + " mm, " + fixed(jitter.rotation_deg, 3) +
                     " deg an axis";
        }
        text += line("object", words);
    }
    text +=
        line("time", fixed(report.total_s, 2) + " s (load " + fixed(report.inputs.load_s, 2) + " s, reading frames " +
                         fixed(report.record.read_s, 2) + " s), " + fixed(frames_per_second(report), 2) + " frames/s");
    text += line("backend", report.backend.name + ": " + report.backend.device);
    for (const BackendStatus& other : report.passed_over) text += line("not used", other.name + ": " + other.reason);
    for (const std::string& note : report.notes) text += line("note", note);
    return text + line("written", report.options.output.folder.string() + ": " + joined(report.outputs, " "));
}

}  // namespace raylign::detail::apps
