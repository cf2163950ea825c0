#include "core/io/poses/pose_file.h"

#include <algorithm>
#include <fstream>
#include <string>

#include "core/base/error.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"
#include "raylign/io/pose.h"

namespace raylign::detail {
namespace {

bool is_own_trajectory(const std::filesystem::path& path) {
    check_readable_file(path);
    std::ifstream file(path, std::ios::binary);
    std::string begin(64, '\0');
    file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
    return begin.starts_with("object,frame,status");
}

std::vector<PoseSequence> sequences_of(const std::vector<TrajectoryRow>& rows) {
    std::vector<PoseSequence> sequences;
    for (const TrajectoryRow& row : rows) {
        auto found = std::ranges::find(sequences, row.object, &PoseSequence::object);
        if (found == sequences.end()) found = sequences.insert(found, {row.object, {}});
        found->frames.push_back({row.frame.frame, pose_of(row.frame)});
    }
    return sequences;
}

}  // namespace

PoseFileFormat pose_file_format(const std::filesystem::path& path) {
    const std::string extension = lower_case(path.extension().string());
    if (extension == ".tra") return PoseFileFormat::tra;
    if (extension == ".jts" || extension == ".jtak" || extension == ".jta") return PoseFileFormat::jointtrack;
    if (extension != ".csv") return PoseFileFormat::single;
    return is_own_trajectory(path) ? PoseFileFormat::trajectory : PoseFileFormat::xmalab;
}

std::vector<PoseSequence> read_pose_file(const std::filesystem::path& path, const PoseFileOptions& options) {
    switch (pose_file_format(path)) {
        case PoseFileFormat::single:
            return {{"", {{1, read_pose(path)}}}};
        case PoseFileFormat::trajectory:
            return sequences_of(read_trajectory(path));
        case PoseFileFormat::tra:
            return read_tra(path, options.shown_grids, options.tra);
        case PoseFileFormat::jointtrack:
            return {read_jointtrack_poses(path)};
        case PoseFileFormat::xmalab:
            return read_xmalab_bodies(path, options.tra.unit_mm);
    }
    return {};
}

std::vector<TrajectoryRow> trajectory_rows(std::span<const PoseSequence> sequences) {
    std::vector<TrajectoryRow> rows;
    for (const PoseSequence& sequence : sequences) {
        for (const FramePose& frame : sequence.frames) {
            TrajectoryRow row{sequence.object.empty() ? "object" : sequence.object, {.frame = frame.frame}};
            row.frame.status = frame.world_from_ct ? TrackStatus::ok : TrackStatus::missing;
            if (frame.world_from_ct) row.frame.world_from_ct = *frame.world_from_ct;
            if (!frame.world_from_ct) row.frame.reasons = {"no pose in the file that was converted"};
            rows.push_back(std::move(row));
        }
    }
    std::ranges::stable_sort(rows, {}, [](const TrajectoryRow& row) { return row.frame.frame; });
    return rows;
}

}  // namespace raylign::detail
