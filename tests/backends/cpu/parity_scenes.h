#pragma once

#include <utility>

#include "cpu_scenes.h"

namespace raylign::detail::test {

/// Scenes that have gone wrong elsewhere, or could: small, so that the reference takes milliseconds.
inline std::vector<NamedScene> parity_scenes() {
    std::vector<NamedScene> scenes;
    const auto add = [&](std::string name, Volume volume, std::vector<View> views) -> NamedScene& {
        scenes.push_back({std::move(name), std::move(volume), std::move(views)});
        return scenes.back();
    };
    const Eigen::Matrix3d facing = Eigen::Matrix3d::Identity();
    const auto cube = [](int n, unsigned seed, double air = 0) {
        return random_volume(Eigen::Vector3i::Constant(n), Eigen::Vector3d::Ones(), seed, air);
    };
    add("oblique", cube(40, 1),
        {view_along(rotation(20, 30, 10), {45, 37}, 1.6), view_along(rotation(100, 10, 50), {40, 40}, 1.6)});
    add("diagonal_axes_meet", cube(33, 2),
        {view_along(rotation(45, 0, 0), {48, 48}, 1.2), view_along(rotation(35, 45, 0), {48, 48}, 1.2)});
    add("along_z_on_planes", cube(33, 3),
        {view_along(facing, {33, 33}, 1.5), view_along(rotation(0, 90, 0), {33, 33}, 1.5),
         view_along(rotation(90, 0, 0), {33, 33}, 1.5)});
    add("mostly_air", cube(70, 4, 0.9),
        {view_along(rotation(20, 30, 10), {64, 70}, 1.5), view_along(rotation(80, 20, 5), {64, 70}, 1.5)});
    add("long_and_flat", random_volume({90, 7, 41}, {0.7, 3, 1.1}, 5),
        {view_along(rotation(70, 25, 40), {60, 50}, 1.7)});
    add("one_voxel_thick", random_volume({40, 40, 1}, {1, 1, 2}, 6),
        {view_along(rotation(20, 30, 10), {40, 40}, 1.6), view_along(rotation(85, 3, 2), {40, 40}, 1.6)});
    add("one_voxel_thick_along_x", random_volume({1, 37, 40}, {1.5, 1, 1}, 20),
        {view_along(rotation(10, 80, 5), {40, 40}, 1.6), view_along(rotation(20, 10, 5), {40, 40}, 1.6)});
    add("one_voxel_thick_along_y_edge_on", random_volume({40, 1, 37}, {1, 1.5, 1}, 21),
        {view_along(rotation(5, 8, 3), {40, 40}, 1.6), view_along(rotation(85, 3, 2), {40, 40}, 1.6)});
    add("one_voxel", random_volume({1, 1, 1}, {5, 6, 7}, 7), {view_along(rotation(20, 30, 10), {21, 21}, 1)});
    add("one_row", cube(30, 8),
        {view_along(rotation(20, 30, 10), {50, 1}, 1), view_along(rotation(20, 30, 10), {1, 50}, 1),
         view_along(rotation(20, 30, 10), {1, 1}, 1)});
    add("one_column", cube(30, 22), {view_along(rotation(20, 30, 10), {1, 53}, 1)});
    add("missing_rays", cube(20, 9),
        {view_along(rotation(20, 30, 10), {60, 60}, 4), view_along(rotation(20, 30, 10), {30, 30}, 1.6)});
    scenes.back().views[1].geometry.camera_from_world.translation_mm.x() = 400;
    add("source_inside", cube(40, 10),
        {view_along(rotation(20, 30, 10), {40, 40}, 30, 3), view_along(facing, {41, 41}, 30, 0)});
    add("detector_inside", cube(40, 11), {view_along(rotation(20, 30, 10), {40, 40}, 1.2, 600, 603.3)});
    add("detector_before_volume", cube(40, 12), {view_along(rotation(20, 30, 10), {40, 40}, 1.2, 600, 500)});
    add("wide_fan", cube(40, 13), {view_along(rotation(20, 30, 10), {64, 48}, 8, 40, 120)});
    add("few_pixels_many_voxels", cube(64, 14), {view_along(rotation(20, 30, 10), {17, 16}, 6)});
    add("many_pixels_few_voxels", cube(12, 15), {view_along(rotation(50, 30, 10), {90, 80}, 0.3)});
    add("no_sdd", cube(30, 16), {view_along(rotation(20, 30, 10), {32, 32}, 1.5)});
    scenes.back().views[0].geometry.camera.sdd_mm.reset();
    Volume oblique = random_volume({37, 29, 31}, {0.8, 1.3, 2.1}, 17);
    oblique.grid.direction = rotation(12, -25, 33);
    oblique.grid.direction.col(1) *= -1;  // mirrored
    oblique.grid.origin_mm = -oblique.grid.centre_ct_mm() + oblique.grid.origin_mm;
    add("oblique_mirrored_grid", oblique,
        {view_along(rotation(20, 30, 10), {45, 37}, 1.6), view_along(rotation(100, 10, 50), {40, 40}, 1.6)});
    add("long_step", cube(30, 18), {view_along(rotation(20, 30, 10), {32, 32}, 1.5)}).step_mm = 7.3;
    add("far_source", cube(64, 19), {view_along(rotation(40, 30, 10), {64, 64}, 1, 20000, 20100)});
    return scenes;
}

}  // namespace raylign::detail::test
