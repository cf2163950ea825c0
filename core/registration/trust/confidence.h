#pragma once

#include <span>

#include "core/registration/level/methods.h"
#include "core/registration/trust/model_error.h"
#include "raylign/result.h"

namespace raylign::detail {

inline constexpr int kGroups = 16;
/// The weights without the blocks of a group: the box of pixels with weight is cut into 8 x 8 blocks, and every group
/// has some in each half of the rows and columns, shifted from view to view.
[[nodiscard]] Image without_group(const Image& weights, int group, std::size_t view);

/// Delete-a-group jackknife [Efron82] [Shao89] over 16 groups of image blocks: with the weights of group g
/// set to zero, one Gauss-Newton step x_g from the pose;
///   covariance = k^2 (G - 1) / G sum_g (x_g - mean) (x_g - mean)^T.
/// Residuals that hang together within a block (smoothed noise, other anatomy) are thereby counted once, where the
/// inverse curvature alone would take every pixel for news. Each view's box of pixels with weight is cut into 8 x 8
/// blocks; a group has blocks of every view, spread over the box. k = `calibration`, fitted on trials
/// (bench/README.md). 16 linearizations on the session's level; its weights are restored, also where it is
/// stopped.
/// Not estimated where a group leaves too little to compare.
[[nodiscard]] Confidence jackknife(const LevelProblem& problem, const RigidTransform& world_from_ct,
                                   double calibration);

/// Fills in what follows from the covariance, for an object of this radius.
void summarise(Confidence& confidence, double radius_mm);

inline constexpr double kCalibration_explained = 1;   ///< noise is all that is left
inline constexpr double kCalibration_mismatch = 1.2;  ///< structures that bias all groups alike: other tissue, metal

inline constexpr double kModelCalibration = 1.3;

/// Adds what biases all groups alike: covariance += k^2 sum over shifts of twist twist^T, k = kModelCalibration, fitted
/// on trials. Nothing where there is no estimate.
void add_model_error(Confidence& confidence, std::span<const ModelShift> shifts, double radius_mm);

/// For one view: what the estimate comes to along its line of sight (unit, in world) and without that.
void split_by_depth(Confidence& confidence, const Eigen::Vector3d& depth_axis);

}  // namespace raylign::detail
