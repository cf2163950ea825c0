#include "apps/poses/opensim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "raylign/joint_motion.h"

namespace raylign::detail::apps {
namespace {

constexpr double kArm_mm = 50;  // as long as a cluster of markers

using FramesByNumber = std::map<int, std::vector<std::optional<RigidTransform>>>;

FramesByNumber by_number(std::span<const PoseSequence> sequences) {
    FramesByNumber frames;
    for (std::size_t s = 0; s < sequences.size(); ++s) {
        for (const FramePose& frame : sequences[s].frames) {
            auto& row = frames[frame.frame];
            row.resize(sequences.size());
            row[s] = frame.world_from_ct;
        }
    }
    if (frames.empty()) throw Error("no frames: nothing to write");
    return frames;
}

std::string name_of(const PoseSequence& sequence) { return sequence.object.empty() ? "object" : sequence.object; }

std::string time_text(int frame, int first, double rate_hz) { return number_text((frame - first) / rate_hz); }

std::array<double, 6> free_joint(const RigidTransform& pose) {
    const Eigen::Vector3d angles = cardan_angles_rad(pose.rotation, CardanSequence::from_name("XYZ"));
    std::array<double, 6> values{};
    for (std::size_t i = 0; i < 3; ++i) {
        values[i] = angles[static_cast<Eigen::Index>(i)] * 180 / std::numbers::pi;
        values[3 + i] = pose.translation_mm[static_cast<Eigen::Index>(i)] / 1000;
    }
    return values;
}

std::array<Eigen::Vector3d, 4> markers_mm(const RigidTransform& pose) {
    std::array<Eigen::Vector3d, 4> markers{pose.translation_mm, {}, {}, {}};
    for (int axis = 0; axis < 3; ++axis) {
        markers[static_cast<std::size_t>(axis) + 1] = pose * Eigen::Vector3d(kArm_mm * Eigen::Vector3d::Unit(axis));
    }
    return markers;
}

}  // namespace

std::string opensim_storage_text(std::span<const PoseSequence> sequences, const std::string& name, double rate_hz) {
    const FramesByNumber frames = by_number(sequences);
    std::string text = name + "\nversion=1\nnRows=" + std::to_string(frames.size()) +
                       "\nnColumns=" + std::to_string(1 + 6 * sequences.size()) + "\ninDegrees=yes\nendheader\ntime";
    for (const PoseSequence& sequence : sequences) {
        for (const char* value : {"rx", "ry", "rz", "tx", "ty", "tz"}) text += "\t" + name_of(sequence) + "_" + value;
    }
    text += "\n";
    for (const auto& [frame, poses] : frames) {
        text += time_text(frame, frames.begin()->first, rate_hz);
        for (const auto& pose : poses) {
            const std::array<double, 6> values = pose ? free_joint(*pose) : std::array<double, 6>{};
            for (const double value : values) text += "\t" + (pose ? number_text(value) : std::string("nan"));
        }
        text += "\n";
    }
    return text;
}

std::string opensim_markers_text(std::span<const PoseSequence> sequences, const std::string& name, double rate_hz) {
    const FramesByNumber frames = by_number(sequences);
    const std::string rate = number_text(rate_hz), count = std::to_string(frames.size());
    std::string text = "PathFileType\t4\t(X/Y/Z)\t" + name +
                       "\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
                       "OrigNumFrames\n" +
                       rate + "\t" + rate + "\t" + count + "\t" + std::to_string(4 * sequences.size()) + "\tmm\t" +
                       rate + "\t1\t" + count + "\nFrame#\tTime";
    std::string axes = "\t";
    int marker = 0;
    for (const PoseSequence& sequence : sequences) {
        for (const char* point : {"_o", "_x", "_y", "_z"}) {
            text += "\t" + name_of(sequence) + point + "\t\t";
            const std::string number = std::to_string(++marker);
            axes += "\tX" + number + "\tY" + number + "\tZ" + number;
        }
    }
    text += "\n" + axes + "\n\n";
    for (const auto& [frame, poses] : frames) {
        text += std::to_string(frame) + "\t" + time_text(frame, frames.begin()->first, rate_hz);
        for (const auto& pose : poses) {
            for (const Eigen::Vector3d& point : markers_mm(pose.value_or(RigidTransform()))) {
                for (const double value : point) text += "\t" + (pose ? number_text(value) : std::string());
            }
        }
        text += "\n";
    }
    return text;
}

}  // namespace raylign::detail::apps
