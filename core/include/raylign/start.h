#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "raylign/camera.h"
#include "raylign/grid.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"

namespace raylign {

/// The start where none is given: the CT's centre at the world point nearest to all views' central rays (through the
/// middle of each image), in least squares, patient axes parallel to world axes. Where the rays leave a direction open
/// (one view, or parallel ones) the point nearest to the world's origin is taken, the isocentre of C-arm geometry.
/// Throws Error, asking for --start, where that point is not between a source and its detector.
[[nodiscard]] RigidTransform default_start(const VoxelGrid& grid, std::span<const View> views);

/// A point of the CT and where one view shows it.
struct LandmarkSighting {
    std::size_t landmark = 0;  ///< which point of the CT
    std::size_t view = 0;
    /// Of the image as the view's camera has it; integers are centres.
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// A pose from landmarks, and how well they fit.
struct LandmarkPose {
    RigidTransform world_from_ct;
    double rms_px = 0;                 ///< over all sightings
    double rms_mm = 0;                 ///< the same, brought to the depth of each point
    std::vector<double> residuals_px;  ///< per sighting
    /// Of the next best, clearly different pose; infinite where there is none. A value near rms_px means that the
    /// landmarks do not tell the two apart.
    double second_rms_px = 0;
};

/// The pose that minimises the sum of squared distances between sightings and projected landmarks (perspective n
/// points in one view or several). Levenberg-Marquardt in the twist about the landmarks' centre from 60 rotations
/// spread evenly over SO(3), each with the centre where its rays meet (in one view: at the depth at which the spread
/// of the points matches); the best end is taken, so no start is needed and points in a plane are no special case.
/// Exact to rounding for exact sightings. Throws Error for fewer than four landmarks with a sighting, landmarks nearly
/// on a line (second principal extent below 5 % of the first), landmarks outside an image by more than its size, and
/// where every end has a landmark behind a source.
[[nodiscard]] LandmarkPose pose_from_landmarks(std::span<const Eigen::Vector3d> landmarks_ct_mm,
                                               std::span<const ViewGeometry> views,
                                               std::span<const LandmarkSighting> sightings);

}  // namespace raylign
