#include "core/tracking/company.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/image/view_crop.h"
#include "core/registration/scene/scene.h"
#include "core/registration/scene/scene_descent.h"

namespace raylign::detail {
namespace {

constexpr int kSure = 2;  // frames that tell a velocity
// Coarser than the quick way of one object by one: what others hide needs no more, and each is then found by itself.
constexpr int kCoarserBy = 2;
constexpr double kApart_mm = 5;  // shadows nearer than this are in one another's filters

bool do_meet(const PixelBox& a, const PixelBox& b) {
    return (a.begin.cwiseMax(b.begin).array() < a.end.cwiseMin(b.end).array()).all();
}

double pixel_at_mm(const View& view, const Eigen::Vector3d& world_mm) {
    const double depth_mm = std::max((view.geometry.camera_from_world * world_mm).z(), 1.0);
    return depth_mm / view.geometry.camera.intrinsics_px(0, 0);
}

/// The boxes of pixels that may show the object, per view.
std::vector<PixelBox> shadows(std::span<const View> views, const ResidentVolume& volume, const RigidTransform& pose) {
    std::vector<PixelBox> boxes;
    for (const View& view : views) {
        const double pixel_mm = pixel_at_mm(view, pose * volume.extent().centre_ct_mm);
        boxes.push_back(reached_pixels(view.geometry, volume.volume().grid, pose,
                                       static_cast<int>(std::min(kApart_mm / pixel_mm, 1e4))));
    }
    return boxes;
}

}  // namespace

void Prospect::remember(const TrackFrame& found) {
    const bool is_ok = found.status == TrackStatus::ok;
    sure_ = is_ok && !found.jumped ? sure_ + 1 : 0;
    if (found.status == TrackStatus::missing && !last_) return;  // still to begin
    if (found.status == TrackStatus::missing && *last_ == TrackStatus::lost) return;
    last_ = found.status;
}

Whereabouts Prospect::whereabouts() const {
    if (!last_) return Whereabouts::start;
    if (*last_ == TrackStatus::lost) return Whereabouts::unknown;
    return sure_ >= kSure ? Whereabouts::near : Whereabouts::rough;
}

Company::Company(std::span<const Volume* const> volumes, const TrackOptions& options, Backend& backend)
    : options_(options) {
    options_.registration.suspect_mirrored = false;  // a track's first frame tells
    for (const Volume* volume : volumes) volumes_.emplace_back(*volume, options.registration.render, backend);
}

bool Company::is_possible(const TrackOptions& options, const Backend& backend) {
    const Method method = options.registration.method;
    const bool is_newton = method == Method::automatic || method == Method::gauss_newton;
    return is_newton && backend.info().has_derivatives;
}

std::vector<std::size_t> Company::who_meet(std::span<const View> views, std::span<const Expectation> expected) const {
    std::vector<std::size_t> known;
    std::vector<std::vector<PixelBox>> boxes;
    bool is_one_lost = false;
    for (std::size_t k = 0; k < expected.size(); ++k) {
        is_one_lost = is_one_lost || expected[k].known == Whereabouts::unknown;
        if (expected[k].known == Whereabouts::unknown) continue;
        known.push_back(k);
        boxes.push_back(shadows(views, volumes_[k], expected[k].world_from_ct));
    }
    if (is_one_lost) return known;  // wherever it is, it may be under any of them
    std::vector<std::size_t> meeting;
    for (std::size_t a = 0; a < known.size(); ++a) {
        bool meets = false;
        for (std::size_t b = 0; b < known.size(); ++b) {
            for (std::size_t v = 0; v < views.size() && a != b; ++v) meets = meets || do_meet(boxes[a][v], boxes[b][v]);
        }
        if (meets) meeting.push_back(known[a]);
    }
    return meeting;
}

/// Where register_scene puts the members: one that it cannot judge stays where it was expected.
std::vector<RigidTransform> Company::begun(std::span<const View> views, std::span<const Expectation> expected,
                                           const RunControl& control) {
    std::vector<SceneObject> objects;
    std::vector<ResidentVolume*> volumes;
    for (const std::size_t k : members_) {
        const Mobility mobility = expected[k].known == Whereabouts::settled ? Mobility::stays : Mobility::moves;
        volumes.push_back(&volumes_[k]);
        objects.push_back({std::to_string(k), volumes_[k].volume(), expected[k].world_from_ct, mobility});
    }
    const SceneResult found = register_resident_scene(objects, volumes, views, options_.registration, control);
    std::vector<RigidTransform> places;
    for (const RegistrationResult& object : found.objects) places.push_back(object.world_from_ct);
    return places;
}

void Company::put_together(std::span<const View> views, std::span<const Expectation> expected,
                           const RunControl& control) {
    const auto any = [&](Whereabouts known) {
        return std::ranges::any_of(members_, [&](std::size_t k) { return expected[k].known == known; });
    };
    const bool begins = any(Whereabouts::start);
    SceneDescent scene(views, options_.registration, control);
    for (const std::size_t k : members_) {
        if (expected[k].known != Whereabouts::settled) scene.moving.push_back(scene.volumes.size());
        scene.volumes.push_back(&volumes_[k]);
        scene.world_from_ct.push_back(expected[k].world_from_ct);
    }
    if (begins) scene.world_from_ct = begun(views, expected, control);
    scene.starts_world_from_ct = scene.world_from_ct;
    scene.guides = scene.moving;
    if (scene.guides.empty()) {
        for (std::size_t k = 0; k < scene.volumes.size(); ++k) scene.guides.push_back(k);
    }
    const bool is_near = begins || scene.moving.empty() || (options_.quick && !any(Whereabouts::rough));
    if (is_near) {
        follow_together(scene, kCoarserBy);
    } else {
        descend_together(scene);
    }
    world_from_ct_ = scene.world_from_ct;
    gains_ = scene.shown.gains;
    const Fineness in_full{0, std::vector<int>(views.size(), 0)};
    for (std::size_t m = 0; m < scene.shown.drrs.size(); ++m) drawings_[{m, in_full}] = std::move(scene.shown.drrs[m]);
}

void Company::meet(std::span<const View> views, std::span<const Expectation> expected, const RunControl& control) {
    drawings_.clear();
    expected_.clear();
    for (const Expectation& object : expected) expected_.push_back(object.world_from_ct);
    members_ = who_meet(views, expected);
    if (members_.empty()) return;
    try {
        put_together(views, expected, control);
    } catch (const Error& error) {  // each object's own tracker meets the same fault, and says so
        if (error.kind() != ErrorKind::input) throw;
        members_.clear();
    }
}

std::vector<LevelPlan> Company::levels(std::span<const View> views, std::size_t object) const {
    const ResidentVolume& volume = volumes_[object];
    return plan_levels(volume.volume(), bare(views), expected_[object], volume.extent(),
                       options_.registration.similarity.filter, options_.registration.levels);
}

const std::vector<Image>& Company::drawing(std::span<const View> views, std::size_t member, const Fineness& fineness) {
    std::vector<Image>& drrs = drawings_[{member, fineness}];
    if (drrs.empty()) drrs = drawn(volumes_[members_[member]], world_from_ct_[member], views, fineness);
    return drrs;
}

std::vector<View> Company::remainder(std::span<const View> views, std::size_t object, std::optional<int> coarser_by) {
    if (members_.empty()) return {views.begin(), views.end()};
    const auto found = std::ranges::find(members_, object);
    std::optional<std::size_t> kept;
    if (found != members_.end()) kept = static_cast<std::size_t>(found - members_.begin());
    LevelPlan level;
    level.image_halvings.assign(views.size(), 0);
    if (coarser_by) level = coarser(levels(views, object), *coarser_by);
    Shown shown{{}, gains_, level.image_halvings};
    for (std::size_t m = 0; m < members_.size(); ++m) {
        shown.drrs.emplace_back();
        if (m == kept) continue;
        const int voxels = coarser_by ? volume_halvings_like(levels(views, members_[m]), level) : 0;
        shown.drrs.back() = drawing(views, m, {voxels, level.image_halvings});
    }
    return detail::remainder(views, shown, kept);
}

}  // namespace raylign::detail
