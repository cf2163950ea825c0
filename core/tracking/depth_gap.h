#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "raylign/camera.h"
#include "raylign/tracking.h"

namespace raylign::detail {

/// How deep an object lies along a view's axis, by one image.
struct DepthSample {
    double depth_mm = 0;
    double sigma_mm = 1;  ///< what it is expected to be off; positive
};
/// Per object; none where it has no depth that counts.
using DepthsOfFrame = std::vector<std::optional<DepthSample>>;

/// Depths of objects whose differences are the same in all frames, give or take `gap_mm` (a standard deviation;
/// positive). Of each pair the difference D is the mean over the frames, weighted by 1 / (v + gap^2) with v the
/// variance of the frame's own difference (errors of two objects in one image are correlated by kCommonError), without
/// frames more than three standard deviations from the median. In each frame the depths z with covariance S are then
/// joined with H z = D, R = gap^2 + var(D), var(D) by the weights:
///   K = S H^T (H S H^T + R)^-1,  z + K (D - H z),  (1 - K H) S (1 - K H)^T + K R' K^T.
/// What is told of the errors takes R' = gap^2 + the mean v: what biases all frames alike no mean takes out, so that D
/// is taken to be no surer than one frame. Nothing changes in frames with one of the two, in those that contradict D by
/// more than three standard deviations, and where a pair is seen in fewer than two frames.
[[nodiscard]] std::vector<DepthsOfFrame> hold_gaps(std::vector<DepthsOfFrame> frames,
                                                   std::span<const std::pair<std::size_t, std::size_t>> pairs,
                                                   double gap_mm);

/// The depth of the object's centre along the view's axis. None of a frame that is not ok, or tells no depth.
[[nodiscard]] std::optional<DepthSample> depth_of(const TrackFrame& frame, const Eigen::Vector3d& centre_ct_mm,
                                                  const ViewGeometry& view);

/// Moves the object along its line of sight to this depth of its centre, so that its place in the image stays.
void move_to(TrackFrame& frame, const DepthSample& depth, const Eigen::Vector3d& centre_ct_mm,
             const ViewGeometry& view);

}  // namespace raylign::detail
