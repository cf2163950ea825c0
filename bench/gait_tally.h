#pragma once

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "bench/record.h"
#include "core/base/median.h"
#include "raylign/targets.h"
#include "raylign/tracking.h"

namespace raylign::detail::bench {

inline constexpr int kPeriod = 100;  ///< frames a step; later steps are the first one again, with other noise

inline double degrees(double rad) { return rad * 180 / std::numbers::pi; }

inline double most(const std::vector<double>& values) { return values.empty() ? 0 : *std::ranges::max_element(values); }

using Shifts = std::vector<Eigen::Vector3d>;  // of targets, found from true

/// Root mean square over the targets, of what differs between frames of one pose (noise), and of their mean without the
/// noise that is left in it (what X-rays and model have in common in all steps). NaN for one step, which cannot tell.
struct SplitError {
    double noise_mm = std::numeric_limits<double>::quiet_NaN(), common_mm = noise_mm;
};

inline SplitError split_error(const std::vector<Shifts>& frames) {
    double noise = 0, common = 0, count = 0;
    const std::size_t repeats = frames.size() / kPeriod;
    for (std::size_t frame = 0; repeats > 1 && frame < kPeriod; ++frame) {
        for (std::size_t i = 0; i < frames[frame].size(); ++i) {
            Eigen::Vector3d mean = Eigen::Vector3d::Zero();
            for (std::size_t k = 0; k < repeats; ++k) mean += frames[frame + k * kPeriod][i];
            mean /= static_cast<double>(repeats);
            double squares = 0;
            for (std::size_t k = 0; k < repeats; ++k) squares += (frames[frame + k * kPeriod][i] - mean).squaredNorm();
            const double variance = squares / static_cast<double>(repeats - 1);
            noise += variance;
            common += mean.squaredNorm() - variance / static_cast<double>(repeats);
            count += 1;
        }
    }
    if (count == 0) return {};
    return {std::sqrt(noise / count), std::sqrt(std::max(0.0, common / count))};
}

/// Second differences of the targets' mean shift over sqrt(6), root mean square an axis.
inline double jitter_mm(const std::vector<Shifts>& frames) {
    const auto middle = [&](std::size_t i) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const Eigen::Vector3d& shift : frames[i]) sum += shift;
        return Eigen::Vector3d(sum / static_cast<double>(frames[i].size()));
    };
    double squares = 0;
    for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
        squares += (middle(i - 1) - 2 * middle(i) + middle(i + 1)).squaredNorm();
    }
    return frames.size() < 3 ? 0 : std::sqrt(squares / (18.0 * static_cast<double>(frames.size() - 2)));
}

/// Of a Tally's row.
inline std::vector<std::string> gait_columns() {
    return {"bone",
            "frames",
            "found the quick way",
            "ok",
            "ok, off by more than 1 mm",
            "processor time a frame, p50 [s]",
            "reading a frame, p50 [s]",
            "error, p50 [mm]",
            "error, most [mm]",
            "turn, p50 [deg]",
            "expected error, p50 [mm]",
            "of it noise, rms [mm]",
            "alike in all steps, rms [mm]",
            "jitter of the error, an axis [mm]"};
}

/// Of a bone followed in one view.
inline std::vector<std::string> depth_columns() {
    return {"bone",
            "frames",
            "ok",
            "in depth, p50 [mm]",
            "in depth, most [mm]",
            "in depth with its sign, p50 [mm]",
            "in depth, rms about the mean [mm]",
            "expected in depth, p50 [mm]",
            "within twice that",
            "in plane, p50 [mm]"};
}

/// What came of a bone's frames.
struct Tally {
    std::vector<double> seconds, read_s, errors_mm, turns_deg, expected_mm;
    std::vector<Shifts> shifts_mm;
    int quick = 0, ok = 0, wrong = 0;

    void take(const TrackFrame& found, const RigidTransform& true_pose, std::span<const Eigen::Vector3d> targets) {
        errors_mm.push_back(mean_target_error_mm(found.world_from_ct, true_pose, targets));
        turns_deg.push_back(degrees(rotation_angle_rad(found.world_from_ct * inverse(true_pose))));
        expected_mm.push_back(found.expected_error_mm);
        Shifts shifts;
        for (const Eigen::Vector3d& target : targets) {
            shifts.emplace_back(found.world_from_ct * target - true_pose * target);
        }
        shifts_mm.push_back(std::move(shifts));
        quick += found.quick;
        ok += found.status == TrackStatus::ok;
        wrong += found.status == TrackStatus::ok && errors_mm.back() > 1;
    }
    void tell(const std::string& name, Record& record) const {
        std::cout << name << ": " << seconds.size() << " frames, quick " << quick << ", ok " << ok
                  << " (off by more than 1 mm: " << wrong << "), processor time a frame median " << median(seconds)
                  << " s, reading " << median(read_s) << " s, error median " << median(errors_mm) << " most "
                  << most(errors_mm) << " mm, turn median " << median(turns_deg) << " most " << most(turns_deg)
                  << " deg, expected error median " << median(expected_mm) << " mm";
        const SplitError split = split_error(shifts_mm);
        if (std::isfinite(split.noise_mm)) {
            std::cout << ", of the error noise " << split.noise_mm << " mm, in all steps alike " << split.common_mm
                      << " mm";
        }
        std::cout << ", jitter of the error " << jitter_mm(shifts_mm) << " mm an axis" << std::endl;
        record.add({name, static_cast<double>(seconds.size()), quick, ok, wrong, median(seconds), median(read_s),
                    median(errors_mm), most(errors_mm), median(turns_deg), median(expected_mm), split.noise_mm,
                    split.common_mm, jitter_mm(shifts_mm)});
    }
};

}  // namespace raylign::detail::bench
