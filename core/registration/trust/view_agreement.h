#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/registration/trust/pose_sums.h"
#include "raylign/result.h"
#include "raylign/view.h"

namespace raylign::detail {

/// What one view alone says at a pose: where it would move the object, and how sure it is of that.
struct ViewEvidence {
    bool is_estimated = false;   ///< all else is zero if not: too few pixels, or a direction that the view cannot see
    Twist step = Twist::Zero();  ///< of the object (rad, mm) about its centre in world: one Gauss-Newton step
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< of the step
    Eigen::Matrix<double, 6, 6> curvature = Eigen::Matrix<double, 6, 6>::Zero();   ///< of the view's cost
    double noise = 0;  ///< noise * curvature^-1 has the mean size of the covariance: what turns cost into likelihood
};

/// How steps scatter beside what the pixels tell.
struct EvidenceScale {
    double calibration = 1;  ///< of the jackknife, as in confidence.h
    /// How far voxels, pixels and interpolation may displace all edges of a view alike, which leaving pixels out does
    /// not show: a standard deviation in the image plane at the object. Along the view and in rotations it counts as
    /// much more as the view sees less of them.
    double displaced_mm = 0;
};
[[nodiscard]] EvidenceScale evidence_scale(double calibration, double resolved_mm);
/// What the finest level resolves: a pixel at the object or a voxel's longest side, whichever is larger.
[[nodiscard]] double resolved_mm(double pixel_at_object_mm, const Eigen::Vector3d& spacing_mm);

/// The evidence of each view at a pose. The covariance comes from a delete-a-group jackknife over 16 groups of each
/// view's own pixels (as in confidence.h): half of it as it is, half in the shape that the inverse curvature has, since
/// 15 degrees of freedom tell six axes badly.
[[nodiscard]] std::vector<ViewEvidence> view_evidence(std::span<const ViewSums> views, const EvidenceScale& scale);

/// Of a view's difference from the others, as a vector of (1/rad^2, 1/mm^2): 5 degrees and 30 mm.
[[nodiscard]] Eigen::Matrix<double, 6, 1> wide_prior_precision();

/// Per view the camera's twist that it would like, against where the others together see the object, under a wide prior
/// (5 degrees, 30 mm), so that directions that nobody sees stay still. `shares`: of the views in the cost. One
/// view, or evidence that is missing: not estimated.
[[nodiscard]] std::vector<ViewCorrection> view_corrections(std::span<const ViewEvidence> evidence,
                                                           std::span<const double> shares, double radius_mm);

/// Both for a finished pose, each view's evidence widened by what a DRR does not model (model_error.h). `moved`: from
/// the pose to where the sums of each view were taken, if elsewhere. `centre_world_mm`: of the object, which the
/// corrections turn about.
[[nodiscard]] std::vector<ViewCorrection> compare_views(std::span<const ViewSums> views, std::span<const Twist> moved,
                                                        std::span<const double> shares, const EvidenceScale& scale,
                                                        double radius_mm, const Eigen::Vector3d& centre_world_mm);

/// The correction as numbers: `twist` (rad, mm) with its covariance, and what it would make of the pose.
[[nodiscard]] ViewCorrection correction_of(const Twist& twist, const Eigen::Matrix<double, 6, 6>& covariance,
                                           const Twist& pose_change, double radius_mm);

/// The view that fits the others worst, of two that do alike the later one; none where nothing is estimated, or where
/// chance or what is expected of the pose anyway explains it. One Gauss-Newton step tells that a view is far off, not
/// how far: it is suspected sooner than it is doubted.
[[nodiscard]] std::optional<std::size_t> suspected_view(const RegistrationResult& result);

/// Sets is_doubtful of all views. Where one is, the pose is no surer than what its correction would make of it.
void judge_views(RegistrationResult& result, double radius_mm);

/// "turned by 1.40 degrees about z (within 0.02)" or "moved by 3.1 mm (along x 2.0, y 1.0, z -2.1; within 0.1)":
/// the turn or the shift, whichever exceeds its sigma more.
[[nodiscard]] std::string correction_text(const ViewCorrection& correction);

/// Adds a reason where views contradict each other, naming the one that fits the others worst.
void doubt_disagreeing_views(const RegistrationResult& result, std::span<const View> views,
                             std::vector<std::string>& reasons);

}  // namespace raylign::detail
