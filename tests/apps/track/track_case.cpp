#include "tests/apps/track/track_case.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "raylign/simulate.h"
#include "tests/support/scenes.h"

namespace raylign::detail::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A shaft with two unequal knobs at one end and a ridge: no two poses look alike. `up`: the knobs' end, along z.
Phantom bone(const Eigen::Vector3d& centre, double up) {
    const auto at = [&](double x, double y, double z) {
        return RigidTransform::translate(centre + Eigen::Vector3d(x, y, up * z));
    };
    Phantom phantom{"bone", {}};
    phantom.solids.emplace_back(EllipticCylinder{at(0, 0, -6), {8, 6}, 22, 0.05});
    phantom.solids.emplace_back(EllipticCylinder{at(0, 0, -6), {5, 3.5}, 21, -0.03});
    phantom.solids.emplace_back(Ellipsoid{at(-9, -4, 18), {9, 12, 8}, 0.04});
    phantom.solids.emplace_back(Ellipsoid{at(10, 3, 20), {8, 8, 9}, 0.05});
    phantom.solids.emplace_back(Box{at(5, 8, -8), {2, 6, 9}, 0.05});
    return phantom;
}

Volume volume_of(const Phantom& phantom, const Eigen::Vector3d& centre) {
    VoxelGrid grid = centred_grid({36, 36, 40}, {1.8, 1.8, 1.8});
    grid.origin_mm += centre;
    return voxelise(phantom, grid, 3);
}

RigidTransform turned(int axis, double angle_deg, const Eigen::Vector3d& centre) {
    Twist turn = Twist::Zero();
    turn[axis] = angle_deg * kDegree;
    return exp_about(turn, centre);
}

}  // namespace

const Eigen::Vector3d TrackCase::kFemurCentre(4, -3, 34), TrackCase::kTibiaCentre(-2, 5, -34);

RigidTransform TrackCase::femur(int frame) {
    const double phase = 0.4 * frame;
    return RigidTransform::translate({3 * std::sin(phase), 2 * std::cos(phase), frame * 0.8}) *
           turned(1, 5 * std::sin(phase), kFemurCentre);
}

RigidTransform TrackCase::tibia(int frame) {
    // About a knee between the two, bent about x, then a little about z.
    return femur(frame) * turned(0, flexion_deg(frame), {0, 0, 0}) * turned(2, 0.5 * frame, {0, 0, 0});
}

TrackCase::TrackCase(const TestFolder& folder) : folder_(folder), views_(biplane_views(72, 150)) {
    write_volume(folder.path("femur.mha"), volume_of(bone(kFemurCentre, -1), kFemurCentre));
    write_volume(folder.path("tibia.mha"), volume_of(bone(kTibiaCentre, 1), kTibiaCentre));
    write_views(folder.path("geometry.json"), views_, {});
    write_pose(folder.path("f.json"), RigidTransform::translate({2, -2, 1}) * femur(1));
    write_pose(folder.path("t.json"), RigidTransform::translate({-1, 2, 2}) * tibia(1));
}

Image TrackCase::xray(std::size_t view, int frame, bool with_tibia) const {
    Image image = exact_drr(bone(kFemurCentre, -1), views_[view].geometry, femur(frame));
    if (with_tibia) {
        const Image other = exact_drr(bone(kTibiaCentre, 1), views_[view].geometry, tibia(frame));
        for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] += other.pixels[i];
    }
    return with_photon_noise(image, 50000, static_cast<std::uint64_t>(10 * frame) + view);
}

std::string TrackCase::name(const std::string& view, int frame) const {
    const std::string digits = std::to_string(frame);
    return folder_.path(view + "." + std::string(4 - digits.size(), '0') + digits + ".tif");
}

void TrackCase::write_frame(const std::string& view, int frame, const Image& image) const {
    write_image(name(view, frame), image);
}

void TrackCase::write_frames(int first, int last) const {
    for (int frame = first; frame <= last; ++frame) {
        for (std::size_t v = 0; v < views_.size(); ++v) write_frame(views_[v].name, frame, xray(v, frame, true));
    }
}

void TrackCase::write_femur_frames(int first, int last) const {
    for (int frame = first; frame <= last; ++frame) {
        for (std::size_t v = 0; v < views_.size(); ++v) write_frame(views_[v].name, frame, xray(v, frame, false));
    }
}

std::vector<std::string> TrackCase::both(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"track",
                                       "--bone",
                                       "femur=" + folder_.path("femur.mha"),
                                       "--bone",
                                       "tibia=" + folder_.path("tibia.mha"),
                                       "--start",
                                       "femur=" + folder_.path("f.json"),
                                       "--start",
                                       "tibia=" + folder_.path("t.json"),
                                       "--joint",
                                       "femur,tibia",
                                       "--content",
                                       "part",
                                       "--attenuation",
                                       "--views",
                                       folder_.path("geometry.json"),
                                       "--frames",
                                       "AP=" + folder_.path("AP.%04d.tif"),
                                       "--frames",
                                       "LAT=" + folder_.path("LAT.*.tif"),
                                       "-o",
                                       folder_.path("track")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

std::vector<std::string> TrackCase::femur_alone(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"track",
                                       "-v",
                                       folder_.path("femur.mha"),
                                       "--attenuation",
                                       "--start",
                                       folder_.path("f.json"),
                                       "--views",
                                       folder_.path("geometry.json"),
                                       "-o",
                                       folder_.path("track")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

}  // namespace raylign::detail::test
