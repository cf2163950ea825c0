#pragma once

#include <span>

#include "core/registration/trust/model_error.h"
#include "core/registration/trust/pose_sums.h"
#include "raylign/result.h"

namespace raylign::detail {

/// Delete-a-group jackknife [Efron82] [Shao89] over 16 groups of image blocks (pose_sums.h): with the weights of group
/// g set to zero, one Gauss-Newton step x_g from the pose;
///   covariance = k^2 (G - 1) / G sum_g (x_g - mean) (x_g - mean)^T.
/// Residuals that hang together within a block (smoothed noise, other anatomy) are thereby counted once, where the
/// inverse curvature alone would take every pixel for news. A group has blocks of every view. k = `calibration`, fitted
/// on trials (bench/README.md). `shares`: of the views in the cost. `by_information`: steps with the curvature that the
/// views have (pose_sums.h), for a part, of which much stays unexplained: its fine edges hold a pose fast that is off
/// by several of the errors which Gauss-Newton's own matrix lets expect. Not estimated where a group leaves too little
/// to compare.
[[nodiscard]] Confidence jackknife(std::span<const ViewSums> views, std::span<const double> shares, double radius_mm,
                                   double calibration, bool by_information = false);

/// Fills in what follows from the covariance, for an object of this radius.
void summarise(Confidence& confidence, double radius_mm);

inline constexpr double kCalibration_explained = 1;   ///< noise is all that is left
inline constexpr double kCalibration_mismatch = 1.2;  ///< structures that bias all groups alike: other tissue, metal

/// By information. Chosen on boxes of a chest CT's vertebrae, 20 poses each (70 of 74 within twice in ideal X-rays, 20
/// before; 58 of 61 in c-arm X-rays), the spine phantom and halves of a pelvis (all 51).
inline constexpr double kCalibration_part = 1.6;

inline constexpr double kModelCalibration = 1.3;

/// Adds what biases all groups alike: covariance += k^2 sum over shifts of twist twist^T, k = kModelCalibration, fitted
/// on trials. Nothing where there is no estimate.
void add_model_error(Confidence& confidence, std::span<const ModelShift> shifts, double radius_mm);

/// For one view: what the estimate comes to along its line of sight (unit, in world) and without that.
void split_by_depth(Confidence& confidence, const Eigen::Vector3d& depth_axis);

}  // namespace raylign::detail
