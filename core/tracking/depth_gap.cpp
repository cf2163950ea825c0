#include "core/tracking/depth_gap.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>

#include "core/base/median.h"
#include "core/registration/scene/joint_update.h"

namespace raylign::detail {
namespace {

constexpr double kStraysBeyond = 3;  // standard deviations: chance does that in one frame of 370

using Pair = std::pair<std::size_t, std::size_t>;

/// Of one pair in one frame.
struct Difference {
    double mm, variance_mm2;
};

std::optional<Difference> difference_of(const DepthsOfFrame& frame, const Pair& pair) {
    const std::optional<DepthSample>&a = frame[pair.first], &b = frame[pair.second];
    if (!a || !b) return std::nullopt;
    return Difference{b->depth_mm - a->depth_mm, a->sigma_mm * a->sigma_mm + b->sigma_mm * b->sigma_mm -
                                                     2 * kCommonError * a->sigma_mm * b->sigma_mm};
}

/// Of one pair in all frames.
struct Gap {
    Pair pair;
    double mm, variance_mm2, of_one_mm2;  ///< of the mean; of one frame's difference
};

std::optional<Gap> gap_of(std::span<const DepthsOfFrame> frames, const Pair& pair, double gap_mm) {
    std::vector<double> all;
    for (const DepthsOfFrame& frame : frames) {
        if (const auto difference = difference_of(frame, pair)) all.push_back(difference->mm);
    }
    if (all.size() < 2) return std::nullopt;
    const double middle = median(all);
    double weights = 0, weighted = 0, variances = 0;
    int count = 0;
    for (const DepthsOfFrame& frame : frames) {
        const auto difference = difference_of(frame, pair);
        if (!difference) continue;
        const double variance = difference->variance_mm2 + gap_mm * gap_mm;
        if (!(std::abs(difference->mm - middle) <= kStraysBeyond * std::sqrt(variance))) continue;
        weights += 1 / variance;
        weighted += difference->mm / variance;
        variances += difference->variance_mm2;
        ++count;
    }
    if (count < 2) return std::nullopt;
    return Gap{pair, weighted / weights, 1 / weights, variances / count};
}

bool is_met(const DepthsOfFrame& frame, const Gap& gap, double gap_mm) {
    const auto difference = difference_of(frame, gap.pair);
    if (!difference) return false;
    const double variance = difference->variance_mm2 + gap_mm * gap_mm + gap.variance_mm2;
    return std::abs(difference->mm - gap.mm) <= kStraysBeyond * std::sqrt(variance);
}

void join(DepthsOfFrame& frame, const std::vector<Gap>& gaps, double gap_mm) {
    const auto objects = static_cast<Eigen::Index>(frame.size()), rows = static_cast<Eigen::Index>(gaps.size());
    Eigen::VectorXd depth = Eigen::VectorXd::Zero(objects), sigma = Eigen::VectorXd::Zero(objects);
    for (Eigen::Index k = 0; k < objects; ++k) {
        if (const auto& sample = frame[static_cast<std::size_t>(k)]) {
            depth[k] = sample->depth_mm;
            sigma[k] = sample->sigma_mm;
        }
    }
    Eigen::MatrixXd covariance = kCommonError * sigma * sigma.transpose();
    covariance.diagonal() = sigma.cwiseAbs2();
    Eigen::MatrixXd across = Eigen::MatrixXd::Zero(rows, objects);
    Eigen::VectorXd missing(rows), used(rows), told(rows);
    for (Eigen::Index r = 0; r < rows; ++r) {
        const Gap& gap = gaps[static_cast<std::size_t>(r)];
        across(r, static_cast<Eigen::Index>(gap.pair.first)) = -1;
        across(r, static_cast<Eigen::Index>(gap.pair.second)) = 1;
        missing[r] = gap.mm - across.row(r).dot(depth);
        used[r] = gap_mm * gap_mm + gap.variance_mm2;
        told[r] = gap_mm * gap_mm + gap.of_one_mm2;
    }
    const Eigen::MatrixXd spread = across * covariance * across.transpose() + Eigen::MatrixXd(used.asDiagonal());
    const Eigen::MatrixXd gain = covariance * across.transpose() * spread.inverse();
    const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(objects, objects) - gain * across;
    depth += gain * missing;
    covariance = rest * covariance * rest.transpose() + gain * told.asDiagonal() * gain.transpose();
    for (Eigen::Index k = 0; k < objects; ++k) {
        auto& sample = frame[static_cast<std::size_t>(k)];
        if (sample) sample = DepthSample{depth[k], std::sqrt(covariance(k, k))};
    }
}

/// An object's centre, as the view sees it.
struct Sighted {
    Eigen::Vector3d from_source_mm;  ///< in world
    double depth_mm;                 ///< along the view's axis

    /// Of a length along the line of sight, how much goes along the axis.
    [[nodiscard]] double slant() const { return depth_mm / from_source_mm.norm(); }
};

Sighted sighted(const TrackFrame& frame, const Eigen::Vector3d& centre_ct_mm, const ViewGeometry& view) {
    const Eigen::Vector3d centre_mm = frame.world_from_ct * centre_ct_mm;
    return {centre_mm - source_world_mm(view), (view.camera_from_world * centre_mm).z()};
}

}  // namespace

std::vector<DepthsOfFrame> hold_gaps(std::vector<DepthsOfFrame> frames, std::span<const Pair> pairs, double gap_mm) {
    std::vector<Gap> gaps;
    for (const Pair& pair : pairs) {
        if (const auto gap = gap_of(frames, pair, gap_mm)) gaps.push_back(*gap);
    }
    for (DepthsOfFrame& frame : frames) {
        std::vector<Gap> met;
        for (const Gap& gap : gaps) {
            if (is_met(frame, gap, gap_mm)) met.push_back(gap);
        }
        if (!met.empty()) join(frame, met, gap_mm);
    }
    return frames;
}

std::optional<DepthSample> depth_of(const TrackFrame& frame, const Eigen::Vector3d& centre_ct_mm,
                                    const ViewGeometry& view) {
    if (frame.status != TrackStatus::ok || !(frame.expected_in_depth_mm > 0)) return std::nullopt;
    const Sighted seen = sighted(frame, centre_ct_mm, view);
    return DepthSample{seen.depth_mm, frame.expected_in_depth_mm * seen.slant()};
}

void move_to(TrackFrame& frame, const DepthSample& depth, const Eigen::Vector3d& centre_ct_mm,
             const ViewGeometry& view) {
    const Sighted at = sighted(frame, centre_ct_mm, view);
    frame.world_from_ct.translation_mm += at.from_source_mm * ((depth.depth_mm - at.depth_mm) / at.depth_mm);
    frame.expected_in_depth_mm = depth.sigma_mm / at.slant();
    frame.expected_error_mm = std::hypot(frame.expected_in_plane_mm, frame.expected_in_depth_mm);
}

}  // namespace raylign::detail
