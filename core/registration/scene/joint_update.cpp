#include "core/registration/scene/joint_update.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"
#include "core/registration/scene/scene_doubts.h"

namespace raylign::detail {
namespace {

constexpr double kContradicts = 22.46;  // chi-square of six degrees of freedom, one in a thousand
constexpr double kDegrees = 180 / std::numbers::pi;

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Lower triangular L with L L^T = matrix, semidefinite: a column without variance is zero.
Matrix6 lower_root(const Matrix6& matrix) {
    Matrix6 root = Matrix6::Zero();
    for (int c = 0; c < 6; ++c) {
        const double variance = matrix(c, c) - root.row(c).squaredNorm();
        if (!(variance > 0)) continue;
        root(c, c) = std::sqrt(variance);
        for (int r = c + 1; r < 6; ++r) root(r, c) = (matrix(r, c) - root.row(r).dot(root.row(c))) / root(c, c);
    }
    return root;
}

/// Where the objects that take part stand among the unknowns: at[k] = -1 where object k does not.
struct Parts {
    std::vector<Eigen::Index> at;
    MatrixXd covariance;
};

Parts parts_of(const SceneDescent& scene, std::span<const RegistrationResult> objects) {
    Parts parts;
    std::vector<Matrix6> roots;
    for (std::size_t k = 0; k < objects.size(); ++k) {
        const bool moves = std::ranges::find(scene.moving, k) != scene.moving.end();
        const bool takes_part = moves && objects[k].confidence.is_estimated;
        parts.at.push_back(takes_part ? static_cast<Eigen::Index>(6 * roots.size()) : -1);
        if (takes_part) roots.push_back(lower_root(objects[k].confidence.covariance));
    }
    const auto count = static_cast<Eigen::Index>(6 * roots.size());
    parts.covariance = MatrixXd::Zero(count, count);
    for (std::size_t a = 0; a < roots.size(); ++a) {
        for (std::size_t b = 0; b < roots.size(); ++b) {
            parts.covariance.block<6, 6>(static_cast<Eigen::Index>(6 * a), static_cast<Eigen::Index>(6 * b)) =
                (a == b ? 1 : kCommonError) * roots[a] * roots[b].transpose();
        }
    }
    return parts;
}

struct Residuals {
    VectorXd residual;
    MatrixXd jacobian;
};

/// One joint's, with derivatives by all unknowns.
Residuals residuals_of(const SceneDescent& scene, const JointPrior& joint, const Parts& parts,
                       std::span<const RegistrationResult> objects) {
    const std::size_t first = joint.limit.first, second = joint.limit.second;
    const auto centre_mm = [&](std::size_t k) {
        return Eigen::Vector3d(objects[k].world_from_ct * scene.volumes[k]->extent().centre_ct_mm);
    };
    const JointResidual at = joint_residual(joint, objects[first].world_from_ct, objects[second].world_from_ct,
                                            centre_mm(first), centre_mm(second));
    Residuals own{at.residual, MatrixXd::Zero(6, parts.covariance.cols())};
    if (parts.at[first] >= 0) own.jacobian.middleCols<6>(parts.at[first]) = at.by_first;
    if (parts.at[second] >= 0) own.jacobian.middleCols<6>(parts.at[second]) = at.by_second;
    return own;
}

MatrixXd spread_of(const Residuals& joints, const Parts& parts) {
    const auto count = joints.residual.size();
    return joints.jacobian * parts.covariance * joints.jacobian.transpose() + MatrixXd::Identity(count, count);
}

void doubt_joint(const JointPrior& joint, const JointMotion& motion, std::span<const std::string> names,
                 std::vector<RegistrationResult>& objects) {
    for (const auto& [own, other] :
         {std::pair{joint.limit.first, joint.limit.second}, std::pair{joint.limit.second, joint.limit.first}}) {
        if (objects[own].levels.empty()) continue;
        objects[own].reasons.push_back("the X-rays contradict its joint with " + names[other] + ": parted by " +
                                       fixed(motion.shift_mm.norm(), 1) + " mm and turned by " +
                                       fixed(motion.turn_rad.norm() * kDegrees, 1) + " degrees, where " +
                                       fixed(joint.limit.apart_mm, 1) + " mm and " + fixed(joint.limit.turned_deg, 1) +
                                       " degrees were said to be the most");
    }
}

/// Moves every object that takes part, and takes over what is left of its covariance.
void update(const SceneDescent& scene, const Parts& parts, const Residuals& joints,
            std::vector<RegistrationResult>& objects) {
    const MatrixXd spread = spread_of(joints, parts);
    const MatrixXd across = joints.jacobian * parts.covariance;
    MatrixXd solved(across.rows(), across.cols());
    for (Eigen::Index c = 0; c < across.cols(); ++c) solved.col(c) = solve_symmetric(spread, VectorXd(across.col(c)));
    const VectorXd moved = -solved.transpose() * joints.residual;
    const MatrixXd covariance = parts.covariance - across.transpose() * solved;
    for (std::size_t k = 0; k < objects.size(); ++k) {
        if (parts.at[k] < 0) continue;
        RegistrationResult& object = objects[k];
        const ObjectExtent& extent = scene.volumes[k]->extent();
        const Eigen::Vector3d centre_mm = object.world_from_ct * extent.centre_ct_mm;
        object.world_from_ct = exp_about(moved.segment<6>(parts.at[k]), centre_mm) * object.world_from_ct;
        const Matrix6 own = covariance.block<6, 6>(parts.at[k], parts.at[k]);
        set_covariance(scene, k, own, object);
    }
}

}  // namespace

std::vector<JointOutcome> settle_joints(const SceneDescent& scene, std::span<const std::string> names,
                                        std::vector<RegistrationResult>& objects) {
    const auto is_told = [&](std::size_t k) {
        return std::ranges::find(scene.moving, k) == scene.moving.end() || objects[k].confidence.is_estimated;
    };
    const Parts parts = parts_of(scene, objects);
    std::vector<JointOutcome> outcomes;
    Residuals all{VectorXd(0), MatrixXd(0, parts.covariance.cols())};
    for (const JointPrior& joint : scene.joints) {
        JointOutcome& outcome = outcomes.emplace_back();
        if (!is_told(joint.limit.first) || !is_told(joint.limit.second)) continue;
        const Residuals own = residuals_of(scene, joint, parts, objects);
        const double squared = own.residual.dot(solve_symmetric(spread_of(own, parts), own.residual));
        outcome.is_used = squared < kContradicts;
        if (!outcome.is_used) {
            doubt_joint(joint,
                        joint_motion(joint, objects[joint.limit.first].world_from_ct,
                                     objects[joint.limit.second].world_from_ct),
                        names, objects);
            continue;
        }
        all.residual.conservativeResize(all.residual.size() + 6);
        all.jacobian.conservativeResize(all.residual.size(), Eigen::NoChange);
        all.residual.tail<6>() = own.residual;
        all.jacobian.bottomRows<6>() = own.jacobian;
    }
    if (all.residual.size() > 0) update(scene, parts, all, objects);
    for (std::size_t j = 0; j < outcomes.size(); ++j) {
        const JointLimit& limit = scene.joints[j].limit;
        outcomes[j].motion =
            joint_motion(scene.joints[j], objects[limit.first].world_from_ct, objects[limit.second].world_from_ct);
    }
    return outcomes;
}

}  // namespace raylign::detail
