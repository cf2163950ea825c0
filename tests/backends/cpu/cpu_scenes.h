#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "backends/cpu/cpu_backend.h"
#include "backends/reference/reference_backend.h"
#include "core/backend.h"

namespace raylign::detail::test {

/// Instruction sets that this processor can run.
inline std::vector<std::string> available_sets() {
    std::vector<std::string> sets;
    for (const InstructionSetStatus& set : cpu_instruction_sets()) {
        if (set.available) sets.emplace_back(instruction_set_name(set.set));
    }
    return sets;
}

/// Uniform random voxels in [0, 0.04] per mm: the hardest content for float coordinates. A share of blocks of 5 voxels
/// is air.
inline Volume random_volume(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm, unsigned seed,
                            double air = 0) {
    Volume volume;
    volume.grid.size = size;
    volume.grid.spacing_mm = spacing_mm;
    volume.grid.origin_mm = -spacing_mm.cwiseProduct((size.cast<double>() - Eigen::Vector3d::Ones()) / 2);
    volume.attenuation_per_mm.resize(volume.grid.voxel_count());
    std::mt19937 random(seed);
    std::vector<bool> empty(4096);
    for (std::size_t i = 0; i < empty.size(); ++i) empty[i] = random() * 0x1p-32 < air;
    for (int z = 0; z < size.z(); ++z) {
        for (int y = 0; y < size.y(); ++y) {
            for (int x = 0; x < size.x(); ++x) {
                const float value = static_cast<float>(0.04 * (random() * 0x1p-32));
                const std::size_t block = (x / 5 * 31 + y / 5 * 57 + z / 5 * 101) % empty.size();
                volume.attenuation_per_mm[volume.index(x, y, z)] = empty[block] ? 0 : value;
            }
        }
    }
    return volume;
}

/// A camera at `sad_mm` from the world's origin that looks at it along R * z.
inline View view_along(const Eigen::Matrix3d& world_from_camera, const Eigen::Vector2i& size_px, double pitch_mm,
                       double sad_mm = 600, double sdd_mm = 900) {
    View view;
    view.name = "view";
    view.geometry.camera = camera_from_pitch(size_px, sdd_mm, {pitch_mm, pitch_mm},
                                             (size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2);
    view.geometry.camera_from_world.rotation = world_from_camera.transpose();
    view.geometry.camera_from_world.translation_mm = {0, 0, sad_mm};
    return view;
}

inline Eigen::Matrix3d rotation(double x_deg, double y_deg, double z_deg) {
    const double deg = EIGEN_PI / 180;
    return (Eigen::AngleAxisd(z_deg * deg, Eigen::Vector3d::UnitZ()) *
            Eigen::AngleAxisd(y_deg * deg, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(x_deg * deg, Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
}

struct NamedScene {
    std::string name;
    Volume volume;
    std::vector<View> views;
    std::optional<double> step_mm;
    [[nodiscard]] Scene scene(Projector projector, const Similarity& similarity = {}) const {
        return {volume, views, {projector, step_mm}, similarity};
    }
};
inline void PrintTo(const NamedScene& scene, std::ostream* out) { *out << scene.name; }

/// Fills every view's image: what the reference sees of the scene at `world_from_ct`, plus a ramp (so that costs are
/// not 0).
inline void add_images(NamedScene& scene, const RigidTransform& world_from_ct) {
    auto session = make_reference_backend()->prepare(scene.scene(Projector::joseph));
    for (std::size_t i = 0; i < scene.views.size(); ++i) {
        Image image = session->render(world_from_ct, i);
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x)
                image(x, y) += 0.01F * static_cast<float>(x) - 0.02F * static_cast<float>(y);
        }
        scene.views[i].image = image;
    }
}

inline RigidTransform pose_near_identity(unsigned seed, double size = 1) {
    std::mt19937 random(seed);
    Twist twist;
    for (int i = 0; i < 6; ++i) twist[i] = size * (i < 3 ? 0.2 : 8) * (random() * 0x1p-31 - 1);
    return exp(twist);
}

}  // namespace raylign::detail::test
