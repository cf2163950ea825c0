#include "core/registration/trust/view_agreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"
#include "core/registration/trust/confidence.h"

namespace raylign::detail {
namespace {

constexpr double kShapeOfCurvature = 0.5;  // share of the curvature's shape in a covariance
constexpr double kWidePrior_deg = 5, kWidePrior_mm = 30;
constexpr double kDegrees = 180 / std::numbers::pi;
/// Of a pixel at the object, or a voxel. Where nearly nothing is left unexplained, voxels and interpolation are all
/// that can displace edges: exact X-rays of the spine phantom against its voxels, both views right, put each view's own
/// depth 3 mm off.
constexpr double kDisplaced_px = 0.02, kDisplacedExplained_px = 0.07;
/// Where nearly all is explained right cameras had up to 1.0. Else, asked alone, up to 1.57 but for a
/// pelvis of 3 mm voxels (1.65), and one turned by a degree 1.0 to 6 (bench/README.md, "Views that contradict each
/// other"): a right pose must not be doubted for it. Looking closer costs several registrations. Where nearly all is
/// explained, one step tells little of what is far off, so suspicion needs less than doubt; else it needs as much.
constexpr double kSignificantExplained = 1.4, kSignificantAlone = 1.55, kSuspectedExplained = 0.5;

/// By how much a view's covariance grows where it was asked alone: what a DRR does not explain pulls one view along the
/// directions that it sees least, depth (by 5 to 20 mm) and turns out of its plane, far more than groups of its pixels
/// differ. Fitted on right cameras, CTs of chest, head and pelvis, two X-ray models, costs of 0.03 to 0.4.
double unexplained_alone(double cost) { return 1 + 0.3 * std::pow(cost / 0.1, 3); }

double suspected_from(const RegistrationResult& result) {
    return result.robust_rounds > 0 ? kSignificantAlone : kSuspectedExplained;
}

constexpr double kLeastEffect_mm = 0.1;
constexpr double kSuspectedEffect = 1, kDoubtfulEffect = 1.5;  // of the error that is expected anyway

Twist step_of(const Linearization& at) { return -solve_symmetric(at.curvature, at.gradient); }

Matrix6 inverse_of_symmetric(const Matrix6& matrix) {
    Matrix6 inverse;
    for (int i = 0; i < 6; ++i) inverse.col(i) = solve_symmetric(matrix, Vector6(Vector6::Unit(i)));
    return (inverse + inverse.transpose()) / 2;
}

using GroupSteps = Eigen::Matrix<double, 6, kGroups>;

GroupSteps steps_without_groups_of(const ViewSums& view) {
    GroupSteps steps;
    for (int group = 0; group < kGroups; ++group) steps.col(group) = step_of(view.without[group]);
    return steps;
}

ViewEvidence evidence_of(const Linearization& at, const GroupSteps& steps, const EvidenceScale& scale) {
    ViewEvidence evidence;
    const GroupSteps deviations = steps.colwise() - steps.rowwise().mean();
    const double factor = scale.calibration * scale.calibration * (kGroups - 1.0) / kGroups;
    const double scatter = factor * (deviations.transpose() * at.curvature * deviations).trace() / 6;
    // In the image plane the curvature is largest: there the displacement's variance shall be what it is.
    const double in_plane = principal_axes(at.curvature.bottomRightCorner<3, 3>()).values[2];
    const double displaced = scale.displaced_mm * scale.displaced_mm * in_plane;
    evidence.step = step_of(at);
    evidence.curvature = at.curvature;
    evidence.noise = scatter + displaced;
    evidence.covariance = (1 - kShapeOfCurvature) * factor * deviations * deviations.transpose() +
                          (kShapeOfCurvature * scatter + displaced) * inverse_of_symmetric(at.curvature);
    evidence.is_estimated = evidence.step.allFinite() && evidence.covariance.allFinite() && evidence.noise > 0;
    return evidence.is_estimated ? evidence : ViewEvidence{};
}

/// Where all views but one see the object, and how surely.
struct OthersSay {
    Twist step;
    Matrix6 covariance;
};

OthersSay others_of(std::span<const ViewEvidence> evidence, std::size_t view) {
    Matrix6 information = Matrix6::Zero();
    Vector6 weighted = Vector6::Zero();
    for (std::size_t u = 0; u < evidence.size(); ++u) {
        if (u == view) continue;
        const Matrix6 of_view = inverse_of_symmetric(evidence[u].covariance);
        information += of_view;
        weighted += of_view * evidence[u].step;
    }
    const Matrix6 covariance = inverse_of_symmetric(information);
    return {covariance * weighted, covariance};
}

double rim_mm(const Twist& twist, double radius_mm) {
    return std::sqrt(twist.tail<3>().squaredNorm() + 0.4 * radius_mm * radius_mm * twist.head<3>().squaredNorm());
}

/// The correction that a difference shows: its mean and spread after the wide prior.
ViewCorrection after_prior(const Twist& difference, const Matrix6& covariance) {
    const Matrix6 prior_covariance = wide_prior_precision().cwiseInverse().asDiagonal();
    const Matrix6 gain = prior_covariance * inverse_of_symmetric(prior_covariance + covariance);
    ViewCorrection correction =
        correction_of(gain * difference, prior_covariance - gain * prior_covariance, Twist::Zero(), 0);
    const double squared = difference.dot(solve_symmetric(covariance, difference));
    correction.significance = std::sqrt(std::max(squared, 0.0) / 6);
    return correction;
}

/// "1.40 degrees about z (within 0.02)", or all three where no axis has nearly all of it.
std::string axes_text(const Eigen::Vector3d& value, const Eigen::Vector3d& sigma, const char* unit, const char* how) {
    constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
    constexpr double kNearlyAll = 0.97;
    Eigen::Index axis = 0;
    value.cwiseAbs().maxCoeff(&axis);
    if (std::abs(value[axis]) > kNearlyAll * value.norm()) {
        return fixed(value[axis], 2) + " " + unit + " " + how + " " + kAxes[axis] + " (within " +
               fixed(sigma[axis], 2) + ")";
    }
    std::string text = fixed(value.norm(), 2) + " " + unit + " (" + how;
    for (int i = 0; i < 3; ++i) text += std::string(i == 0 ? " " : ", ") + kAxes[i] + " " + fixed(value[i], 2);
    return text + "; within " + fixed(sigma.norm(), 2) + ")";
}

Twist twist_of(const ViewCorrection& correction) {
    Twist twist;
    twist << correction.rotation_deg / kDegrees, correction.translation_mm;
    return twist;
}

bool matters(const ViewCorrection& correction, double least_mm) {
    return correction.is_estimated && !correction.is_applied &&
           correction.effect_mm > std::max(kLeastEffect_mm, least_mm);
}

}  // namespace

EvidenceScale evidence_scale(double calibration, double resolved_mm) {
    const bool is_explained = calibration == kCalibration_explained;
    return {calibration, (is_explained ? kDisplacedExplained_px : kDisplaced_px) * resolved_mm};
}

double resolved_mm(double pixel_at_object_mm, const Eigen::Vector3d& spacing_mm) {
    return std::max(pixel_at_object_mm, spacing_mm.maxCoeff());
}

std::vector<ViewEvidence> view_evidence(std::span<const ViewSums> views, const EvidenceScale& scale) {
    std::vector<ViewEvidence> evidence(views.size());
    if (!std::ranges::all_of(views, &ViewSums::leaves_enough)) return evidence;
    for (std::size_t v = 0; v < views.size(); ++v) {
        evidence[v] = evidence_of(views[v].all, steps_without_groups_of(views[v]), scale);
    }
    return evidence;
}

Vector6 wide_prior_precision() {
    Vector6 precision = Vector6::Constant(std::pow(kWidePrior_mm, -2));
    precision.head<3>().setConstant(std::pow(kWidePrior_deg / kDegrees, -2));
    return precision;
}

std::vector<ViewCorrection> view_corrections(std::span<const ViewEvidence> evidence, std::span<const double> shares,
                                             double radius_mm) {
    std::vector<ViewCorrection> corrections(evidence.size());
    const bool is_known = std::ranges::all_of(evidence, [](const ViewEvidence& e) { return e.is_estimated; });
    if (evidence.size() < 2 || !is_known) return corrections;
    Matrix6 curvature = Matrix6::Zero();
    for (std::size_t v = 0; v < evidence.size(); ++v) curvature += shares[v] * evidence[v].curvature;
    for (std::size_t v = 0; v < evidence.size(); ++v) {
        const OthersSay others = others_of(evidence, v);
        ViewCorrection& correction = corrections[v];
        correction = after_prior(others.step - evidence[v].step, others.covariance + evidence[v].covariance);
        const Vector6 pull = shares[v] * evidence[v].curvature * twist_of(correction);
        correction.pose_change = solve_symmetric(curvature, pull);
        correction.effect_mm = rim_mm(correction.pose_change, radius_mm);
    }
    return corrections;
}

std::vector<ViewCorrection> compare_views(std::span<const ViewSums> views, std::span<const Twist> moved,
                                          std::span<const double> shares, const EvidenceScale& scale, double radius_mm,
                                          const Eigen::Vector3d& centre_world_mm) {
    std::vector<ViewEvidence> evidence = view_evidence(views, scale);
    const std::vector<std::vector<ModelShift>> shifts = model_shifts_of_views(views);
    for (std::size_t v = 0; v < evidence.size(); ++v) {
        if (!evidence[v].is_estimated) continue;
        for (const ModelShift& shift : shifts[v]) {
            evidence[v].covariance += std::pow(kModelCalibration, 2) * shift.twist * shift.twist.transpose();
        }
        if (moved.empty()) continue;
        evidence[v].step += moved[v];
        evidence[v].covariance *= unexplained_alone(views[v].all.cost);
    }
    std::vector<ViewCorrection> corrections = view_corrections(evidence, shares, radius_mm);
    for (ViewCorrection& correction : corrections) correction.centre_world_mm = centre_world_mm;
    return corrections;
}

ViewCorrection correction_of(const Twist& twist, const Matrix6& covariance, const Twist& pose_change,
                             double radius_mm) {
    const Vector6 sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
    ViewCorrection correction;
    correction.is_estimated = true;
    correction.rotation_deg = kDegrees * twist.head<3>();
    correction.translation_mm = twist.tail<3>();
    correction.rotation_sigma_deg = kDegrees * sigma.head<3>();
    correction.translation_sigma_mm = sigma.tail<3>();
    correction.significance = std::sqrt(std::max(twist.dot(solve_symmetric(covariance, twist)), 0.0) / 6);
    correction.pose_change = pose_change;
    correction.effect_mm = rim_mm(pose_change, radius_mm);
    return correction;
}

std::optional<std::size_t> suspected_view(const RegistrationResult& result) {
    std::optional<std::size_t> worst;
    for (std::size_t v = 0; v < result.views.size(); ++v) {
        const ViewCorrection& correction = result.views[v].correction;
        if (!(correction.significance > suspected_from(result)) ||
            !matters(correction, kSuspectedEffect * result.confidence.rim_mm))
            continue;
        // Of two views either may be wrong: people trust the one named first.
        constexpr double kAlike = 0.95;
        if (worst && correction.significance < kAlike * result.views[*worst].correction.significance) continue;
        worst = v;
    }
    return worst;
}

void judge_views(RegistrationResult& result, double radius_mm) {
    const double expected_mm = result.confidence.rim_mm;
    const double significant = result.robust_rounds > 0 ? kSignificantAlone : kSignificantExplained;
    const ViewCorrection* most = nullptr;
    for (ViewResult& view : result.views) {
        ViewCorrection& correction = view.correction;
        correction.is_doubtful =
            correction.significance > significant && matters(correction, kDoubtfulEffect * expected_mm);
        if (correction.is_doubtful && (!most || correction.effect_mm > most->effect_mm)) most = &correction;
    }
    if (!most || !result.confidence.is_estimated) return;
    result.confidence.covariance += most->pose_change * most->pose_change.transpose();
    summarise(result.confidence, radius_mm);
}

std::string correction_text(const ViewCorrection& c) {
    const double turned = c.rotation_deg.cwiseQuotient(c.rotation_sigma_deg).norm();
    const double moved = c.translation_mm.cwiseQuotient(c.translation_sigma_mm).norm();
    if (turned >= moved) return "turned by " + axes_text(c.rotation_deg, c.rotation_sigma_deg, "degrees", "about");
    return "moved by " + axes_text(c.translation_mm, c.translation_sigma_mm, "mm", "along");
}

void doubt_disagreeing_views(const RegistrationResult& result, std::span<const View> views,
                             std::vector<std::string>& reasons) {
    const ViewCorrection* worst = nullptr;
    std::size_t index = 0;
    for (std::size_t v = 0; v < result.views.size(); ++v) {
        const ViewCorrection& correction = result.views[v].correction;
        if (!correction.is_doubtful || (worst && correction.significance < worst->significance)) continue;
        worst = &correction;
        index = v;
    }
    if (!worst) return;
    if (worst->is_applied) {
        reasons.push_back("the camera of view " + views[index].name + " was " + correction_text(*worst) +
                          ", far more than it may be off: is it the right geometry, and is the start near enough?");
        return;
    }
    reasons.push_back("the views contradict each other: " + views[index].name + " fits best if its camera is " +
                      correction_text(*worst) + ", which would move the pose by " + fixed(worst->effect_mm, 2) +
                      " mm: is its geometry right?");
}

}  // namespace raylign::detail
