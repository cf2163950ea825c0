#pragma once

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "raylign/io/views.h"
#include "raylign/io/volume.h"

namespace raylign::detail::test {

/// Real biplane X-rays of a wrist and the CT of one of its bones: other bones, hand and soft tissue lie over the
/// radius. `folder` holds the files that Autoscoper comes with; instants are 2 and 99.
struct Wrist {
    Volume radius;
    std::vector<View> views;
    /// From another program, no gold standard: over its restarts the bone's centre moved by up to 0.15 mm and the
    /// rotation by up to 1.4 degrees.
    RigidTransform reference_world_from_ct;
};

/// x_world = R ((column, row, slice) .* spacing - middle) + t.
inline RigidTransform wrist_reference(const std::filesystem::path& folder, int instant, const VoxelGrid& grid) {
    std::ifstream file(folder / "reference_poses.json");
    for (const auto& entry : nlohmann::json::parse(file)) {
        if (entry["frame"] != instant) continue;
        RigidTransform pose;
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) pose.rotation(r, c) = entry["R"][r][c];
            pose.translation_mm[r] = entry["t"][r];
        }
        return pose * RigidTransform::translate(-grid.centre_ct_mm());
    }
    throw std::runtime_error("no such instant");
}

inline Wrist read_wrist(const std::filesystem::path& folder, int instant) {
    VolumeReadOptions options;
    options.spacing_mm = Eigen::Vector3d(0.39625, 0.39625, 0.625);
    options.hu_offset = -1024;
    Wrist wrist;
    wrist.radius = read_volume(folder / "rad_dcm_cropped.tif", options).volume;
    const std::string number = instant < 10 ? "000" + std::to_string(instant) : "00" + std::to_string(instant);
    std::vector<std::string> views;
    for (const std::string camera : {"cam01", "cam02"}) {
        views.push_back((folder / ("xr_calib_wrist_" + camera + ".txt")).string() + "=" +
                        (folder / ("xr_rad_uln_" + camera + "_UND." + number + ".tif")).string());
    }
    wrist.views = read_views(views, ViewsReadOptions{.auto_mask = true}).views;
    wrist.reference_world_from_ct = wrist_reference(folder, instant, wrist.radius.grid);
    return wrist;
}

}  // namespace raylign::detail::test
