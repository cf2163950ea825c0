#include "apps/track/frame_journal.h"

#include <algorithm>

#include "core/base/error.h"

namespace raylign::detail::apps {
namespace {

Json pose_json(const RigidTransform& b_from_a) {
    return {{"rotation", matrix_json(b_from_a.rotation)}, {"translation_mm", vector_json(b_from_a.translation_mm)}};
}

RigidTransform pose_from(const Json& json) {
    RigidTransform pose;
    for (Eigen::Index r = 0; r < 3; ++r) {
        for (Eigen::Index c = 0; c < 3; ++c) {
            pose.rotation(r, c) =
                json.at("rotation").at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
        }
        pose.translation_mm[r] = json.at("translation_mm").at(static_cast<std::size_t>(r)).get<double>();
    }
    return pose;
}

TrackStatus status_from(const std::string& name) {
    for (const TrackStatus status : {TrackStatus::ok, TrackStatus::doubtful, TrackStatus::lost, TrackStatus::missing}) {
        if (name == status_name(status)) return status;
    }
    throw bad_value("status", name, "ok, doubtful, lost or missing");
}

Json frame_json_exactly(const TrackFrame& frame) {
    return {{"frame", frame.frame},
            {"status", status_name(frame.status)},
            {"world_from_ct", pose_json(frame.world_from_ct)},
            {"predicted_world_from_ct", pose_json(frame.predicted_world_from_ct)},
            {"jump_mm", frame.jump_mm},
            {"cost", frame.cost},
            {"view_costs", frame.view_costs},
            {"expected_error_mm", frame.expected_error_mm},
            {"expected_in_plane_mm", frame.expected_in_plane_mm},
            {"expected_in_depth_mm", frame.expected_in_depth_mm},
            {"expected_turn_deg", frame.expected_turn_deg},
            {"searched", search_name(frame.searched)},
            {"recovered", frame.recovered},
            {"jumped", frame.jumped},
            {"content", content_name(frame.content)},
            {"quick", frame.quick},
            {"quick_view_costs", frame.quick_view_costs},
            {"quick_agrees", frame.quick_agrees},
            {"quick_error_ratio", frame.quick_error_ratio},
            {"reasons", frame.reasons},
            {"time_s", frame.time_s}};
}

TrackFrame frame_from(const Json& json) {
    TrackFrame frame;
    frame.frame = json.at("frame").get<int>();
    frame.status = status_from(json.at("status").get<std::string>());
    frame.world_from_ct = pose_from(json.at("world_from_ct"));
    frame.predicted_world_from_ct = pose_from(json.at("predicted_world_from_ct"));
    frame.jump_mm = json.at("jump_mm").get<double>();
    frame.cost = json.at("cost").get<double>();
    frame.view_costs = json.at("view_costs").get<std::vector<double>>();
    frame.expected_error_mm = json.at("expected_error_mm").get<double>();
    frame.expected_in_plane_mm = json.at("expected_in_plane_mm").get<double>();
    frame.expected_in_depth_mm = json.at("expected_in_depth_mm").get<double>();
    frame.expected_turn_deg = json.at("expected_turn_deg").get<double>();
    frame.searched = search_from_name(json.at("searched").get<std::string>());
    frame.recovered = json.at("recovered").get<bool>();
    frame.jumped = json.at("jumped").get<bool>();
    frame.content = content_from_name(json.at("content").get<std::string>());
    frame.quick = json.at("quick").get<bool>();
    frame.quick_view_costs = json.at("quick_view_costs").get<std::vector<double>>();
    frame.quick_agrees = json.at("quick_agrees").get<bool>();
    frame.quick_error_ratio = json.at("quick_error_ratio").get<double>();
    frame.reasons = json.at("reasons").get<std::vector<std::string>>();
    frame.time_s = json.at("time_s").get<double>();
    return frame;
}

}  // namespace

std::string journal_line(const JournalRow& row) {
    Json json{{"object", row.object}, {"chain", row.chain}};
    json["after"] = row.after ? Json(*row.after) : Json(nullptr);
    json["agrees"] = row.agrees;
    json["sha256"] = row.sha256;
    json["frame"] = frame_json_exactly(row.frame);
    return one_line(json);
}

JournalRow journal_row(const std::string& line) {
    const Json json = json_of_line(line);
    try {
        JournalRow row;
        row.object = json.at("object").get<std::string>();
        row.chain = json.at("chain").get<std::string>();
        if (!json.at("after").is_null()) row.after = json.at("after").get<int>();
        row.agrees = json.at("agrees").get<bool>();
        row.sha256 = json.at("sha256").get<std::vector<std::string>>();
        row.frame = frame_from(json.at("frame"));
        return row;
    } catch (const nlohmann::json::exception& problem) {
        throw Error(std::string("no row of a track: ") + problem.what());
    }
}

FrameJournal::FrameJournal(const std::filesystem::path& folder, const std::string& config)
    : journal_(folder / kName, config, {"raylign_track", "track", JournalKind::Other::set_aside}) {
    for (std::size_t i = 0; i < journal_.lines().size(); ++i) {
        try {
            JournalRow row = journal_row(journal_.lines()[i]);
            const auto key = std::pair(row.object, row.frame.frame);
            rows_[key].push_back(std::move(row));
        } catch (const Error& problem) {
            throw Error(journal_.place_of(i) + " is damaged: " + problem.what());
        }
    }
}

const JournalRow* FrameJournal::find(const std::string& object, int frame, const std::string& chain,
                                     std::optional<int> after) const {
    const auto found = rows_.find({object, frame});
    if (found == rows_.end()) return nullptr;
    const auto row = std::ranges::find_if(found->second.rbegin(), found->second.rend(),
                                          [&](const JournalRow& r) { return r.chain == chain && r.after == after; });
    return row == found->second.rend() ? nullptr : &*row;
}

const JournalRow* FrameJournal::other(const std::string& object, int frame, const std::string& chain) const {
    const auto found = rows_.find({object, frame});
    if (found == rows_.end()) return nullptr;
    const auto row = std::ranges::find_if(found->second.rbegin(), found->second.rend(),
                                          [&](const JournalRow& r) { return r.chain != chain; });
    return row == found->second.rend() ? nullptr : &*row;
}

void FrameJournal::append(const JournalRow& row) {
    journal_.append(journal_line(row));
    rows_[{row.object, row.frame.frame}].push_back(row);
}

}  // namespace raylign::detail::apps
