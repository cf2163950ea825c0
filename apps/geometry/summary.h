#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "raylign/io/geometry.h"

namespace raylign::detail::apps {

/// One view as `geometry` explains it.
struct ViewSummary {
    std::filesystem::path file;
    std::string format;
    std::string name;
    ViewGeometry geometry;
    ImageFlip flip = ImageFlip::none;
    std::optional<Distortion> distortion;
    std::vector<std::string> assumptions;
};

/// Angles of the detector as of a C-arm whose world is LPS (CArm): d = direction from source to detector;
/// secondary = asin(d_z), primary = atan2(d_x, -d_y), and the turn of the image about the central axis against the
/// C-arm's own columns. Degrees.
struct CArmAngles {
    double primary_deg = 0, secondary_deg = 0, in_plane_deg = 0;
};
[[nodiscard]] CArmAngles c_arm_angles(const RigidTransform& camera_from_world);

/// Tells people K, source and detector in world, angles, field of view at the isocentre (the world's origin) and
/// assumptions.
[[nodiscard]] std::string geometry_text(const std::vector<ViewSummary>& views);
/// The same as JSON.
[[nodiscard]] std::string geometry_json(const std::vector<ViewSummary>& views);

}  // namespace raylign::detail::apps
