#include "apps/shared/articulated.h"

#include <numbers>

#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/views/view_files.h"
#include "core/registration/object/pose_space.h"
#include "raylign/intensity.h"
#include "raylign/io/pose.h"

namespace raylign::detail::apps {
namespace {

constexpr double kLargest_mm = 500, kLargest_deg = 180;

/// NAME and FILE; FILE may be missing.
struct Move {
    LabelledName object;
    std::filesystem::path pose;
};

Move move_of(const std::string& argument) {
    Move move;
    std::string label = argument;
    if (argument.find('=') != std::string::npos) {
        const auto [name, file] = split_named(argument, "--move", "NAME=FILE");
        label = name;
        move.pose = file;
    }
    move.object = {number_from(label) ? "label_" + label : label, {label}};
    if (!is_view_name(move.object.name)) {
        throw bad_value("name of --move", label, "letters, digits, '_', '-' or '.' (it becomes part of file names)");
    }
    return move;
}

}  // namespace

void settle_conflicts(const ArticulationFlags& flags, const VolumeFlags& volume) {
    if (flags.moves.empty() && !flags.by.empty()) throw Error("--by has no meaning without --move");
    if (flags.moves.empty()) return;
    if (volume.labels.empty()) throw Error("--move " + flags.moves.front() + " needs the map: give --labels FILE");
    if (!volume.label.empty()) throw Error("--label contradicts --move: it names the labels");
    if (volume.bone_threshold) throw Error("--bone-threshold contradicts --move: tissue is shown, too");
    (void)motion_limits(flags);
    for (const std::string& argument : flags.moves) (void)move_of(argument);
}

MotionLimits motion_limits(const ArticulationFlags& flags) {
    if (flags.by.empty()) return {};
    const std::vector<double> numbers = parse_numbers(flags.by, 2, "--by");
    if (!(numbers[0] >= 0 && numbers[0] <= kLargest_mm && numbers[1] >= 0 && numbers[1] <= kLargest_deg)) {
        throw bad_value("--by", flags.by, "MM in [0, 500] and DEG in [0, 180]");
    }
    return {numbers[0], numbers[1]};
}

RigidTransform random_motion(const MotionLimits& limits, const Eigen::Vector3d& centre_world_mm, Random& random) {
    Twist twist;
    for (int i = 0; i < 6; ++i) {
        const double limit = i < 3 ? limits.deg * std::numbers::pi / 180 : limits.mm;
        twist[i] = random.uniform(-limit, limit);
    }
    return exp_about(twist, centre_world_mm);
}

LabelledObjects cut_moving(const ArticulationFlags& flags, const VolumeFlags& volume, const Volume& ct) {
    const HuPreset& preset = volume.hu_preset.empty() ? hu_presets().front() : hu_preset(volume.hu_preset);
    ObjectCut cut{volume.labels, volume.label_table, {}, attenuation_from_hu(0, preset), true};
    for (const std::string& argument : flags.moves) cut.objects.push_back(move_of(argument).object);
    return cut_objects(ct, cut);
}

std::vector<PlacedObject> articulated(const ArticulationFlags& flags, const VolumeFlags& volume, const Volume& ct,
                                      const RigidTransform& world_from_ct, std::uint64_t seed) {
    LabelledObjects found = cut_moving(flags, volume, ct);
    const MotionLimits limits = motion_limits(flags);
    Random random(seed);
    std::vector<PlacedObject> placed{{"rest", std::move(*found.rest), world_from_ct}};
    for (std::size_t k = 0; k < flags.moves.size(); ++k) {
        Volume& own = found.objects[k];
        const Eigen::Vector3d centre_world_mm = world_from_ct * object_extent(own).centre_ct_mm;
        const RigidTransform motion = random_motion(limits, centre_world_mm, random);
        const Move move = move_of(flags.moves[k]);
        const RigidTransform pose = move.pose.empty() ? motion * world_from_ct : read_pose(move.pose);
        placed.push_back({found.names[k], std::move(own), pose});
    }
    return placed;
}

}  // namespace raylign::detail::apps
