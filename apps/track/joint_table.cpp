#include "apps/track/joint_table.h"

#include <algorithm>
#include <numbers>

#include "apps/track/run.h"
#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail::apps {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::size_t kNumbers = 3 + 3 + 2 + 3 + 3;

}  // namespace

std::vector<JointRow> joint_rows(const std::vector<TrajectoryRow>& trajectory, const TrackObject& proximal,
                                 const TrackObject& distal, const CardanSequence& sequence) {
    const auto of_proximal = frames_of(trajectory, proximal.name), of_distal = frames_of(trajectory, distal.name);
    if (of_proximal.size() != of_distal.size()) throw Error("joint: both bones need the same frames");
    std::vector<JointRow> rows;
    std::optional<RigidTransform> first;
    for (std::size_t i = 0; i < of_proximal.size(); ++i) {
        JointRow row{.frame = of_proximal[i]->frame, .status = std::max(of_proximal[i]->status, of_distal[i]->status)};
        const auto a = pose_of(*of_proximal[i]), b = pose_of(*of_distal[i]);
        if (a && b) {
            row.proximal_from_distal = inverse(*a * proximal.ct_from_axes) * *b * distal.ct_from_axes;
            if (!first) first = row.proximal_from_distal;
            row.angles_rad = cardan_angles_rad(row.proximal_from_distal->rotation, sequence);
            row.helical = helical_axis(*row.proximal_from_distal * inverse(*first));
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

std::string joint_csv(const std::vector<JointRow>& rows, const CardanSequence& sequence) {
    std::string text = "frame,status,";
    const std::string names = detail::lower_case(sequence.name());
    for (int turn = 0; turn < 3; ++turn) {
        text +=
            std::string("angle_") + std::to_string(turn + 1) + "_" + names[static_cast<std::size_t>(turn)] + "_deg,";
    }
    text +=
        "x_mm,y_mm,z_mm,helical_angle_deg,helical_shift_mm,helical_x,helical_y,helical_z,helical_point_x_mm,"
        "helical_point_y_mm,helical_point_z_mm\n";
    for (const JointRow& row : rows) {
        text += std::to_string(row.frame) + "," + std::string(status_name(row.status));
        if (!row.proximal_from_distal) {
            text += std::string(kNumbers, ',') + "\n";
            continue;
        }
        const Eigen::Vector3d angles_deg = row.angles_rad * kDegrees;
        const Eigen::Vector3d& t = row.proximal_from_distal->translation_mm;
        const HelicalAxis& h = row.helical;
        for (const double value :
             {angles_deg[0], angles_deg[1], angles_deg[2], t.x(), t.y(), t.z(), h.angle_rad * kDegrees, h.shift_mm,
              h.direction.x(), h.direction.y(), h.direction.z(), h.point_mm.x(), h.point_mm.y(), h.point_mm.z()}) {
            text += "," + detail::number_text(value);
        }
        text += "\n";
    }
    return text;
}

}  // namespace raylign::detail::apps
