#include "core/tracking/smoothing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/random.h"

namespace raylign::detail {
namespace {

const Eigen::Vector3d kPoint(12, -7, 30);

/// As a knee in gait: slow turns and shifts.
RigidTransform motion(double frame) {
    const double phase = 2 * std::numbers::pi * frame / 100;
    return RigidTransform::translate({10 * std::sin(phase), 3 * std::cos(phase), 0.2 * frame}) *
           exp((Twist() << 0.5 * std::sin(phase), 0.05 * std::cos(phase), 0.1 * std::sin(2 * phase), 0, 0, 0)
                   .finished());
}

double gauss(Random& random) {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += random.uniform();
    return sum;
}

/// The motion with white noise of these sizes about the point.
std::vector<TrackSample> noisy(int frames, double sigma_mm, double sigma_rad) {
    Random random(5);
    std::vector<TrackSample> track;
    for (int k = 0; k < frames; ++k) {
        Twist error;
        for (int i = 0; i < 3; ++i) error[i] = sigma_rad * gauss(random);
        for (int i = 3; i < 6; ++i) error[i] = sigma_mm * gauss(random);
        track.push_back({exp_about(error, motion(k) * kPoint) * motion(k), 1});
    }
    return track;
}

struct Errors {
    double mm = 0, rad = 0;
};

Errors errors_of(const std::vector<std::optional<RigidTransform>>& poses) {
    Errors squares;
    for (std::size_t k = 0; k < poses.size(); ++k) {
        const RigidTransform truth = motion(static_cast<double>(k));
        squares.mm += (*poses[k] * kPoint - truth * kPoint).squaredNorm();
        squares.rad += log(*poses[k] * inverse(truth)).head<3>().squaredNorm();
    }
    const double share = 1 / (3 * static_cast<double>(poses.size()));
    return {std::sqrt(squares.mm * share), std::sqrt(squares.rad * share)};
}

TEST(Smoothing, TakesMostOfTheNoiseAndLittleOfTheMotion) {
    constexpr double kSigma_mm = 0.3, kSigma_rad = 0.01;
    const std::vector<TrackSample> track = noisy(200, kSigma_mm, kSigma_rad);
    const Errors errors = errors_of(smoothed(track, kPoint).world_from_ct);
    EXPECT_LT(errors.mm, 0.5 * kSigma_mm);
    EXPECT_LT(errors.rad, 0.5 * kSigma_rad);
}

TEST(Smoothing, AMotionWithoutNoiseStaysWhereItIs) {
    const Errors errors = errors_of(smoothed(noisy(100, 0, 0), kPoint).world_from_ct);
    EXPECT_LT(errors.mm, 1e-3);
    EXPECT_LT(errors.rad, 1e-4);
}

TEST(Smoothing, ASteadyTurnAndShiftStaysAtAnyStrength) {
    std::vector<TrackSample> track;
    for (int k = 0; k < 30; ++k) {
        Twist turn = Twist::Zero();
        turn[1] = 0.1 * k;
        const RigidTransform rotation = exp(turn);
        track.push_back(
            {RigidTransform::translate(Eigen::Vector3d(1.0 * k, 0, -2.0 * k) - rotation * kPoint) * rotation, 1});
    }
    const SmoothTrack smooth = smoothed(track, kPoint, 1e4);
    for (std::size_t k = 0; k < track.size(); ++k) {
        EXPECT_LT((*smooth.world_from_ct[k] * kPoint - *track[k].world_from_ct * kPoint).norm(), 1e-6) << k;
        EXPECT_LT((smooth.world_from_ct[k]->rotation - track[k].world_from_ct->rotation).norm(), 1e-8) << k;
    }
}

TEST(Smoothing, FramesThatAreSurerCountForMore) {
    std::vector<TrackSample> track = noisy(60, 0, 0);
    track[30].world_from_ct->translation_mm.x() += 2;
    const auto at_30 = [&] {
        return (*smoothed(track, kPoint, 10).world_from_ct[30] * kPoint - motion(30) * kPoint).norm();
    };
    const double as_sure = at_30();
    track[30].sigma = 10;
    EXPECT_LT(at_30(), 0.1 * as_sure);
}

TEST(Smoothing, GapsStayGapsAndShortTracksAsTheyAre) {
    std::vector<TrackSample> track = noisy(40, 0.1, 0.002);
    track[0].world_from_ct.reset();
    track[17].world_from_ct.reset();
    track[18].world_from_ct.reset();
    const SmoothTrack smooth = smoothed(track, kPoint);
    for (std::size_t k = 0; k < track.size(); ++k) {
        EXPECT_EQ(smooth.world_from_ct[k].has_value(), track[k].world_from_ct.has_value()) << k;
    }
    const std::vector<TrackSample> three(track.begin() + 1, track.begin() + 4);
    EXPECT_EQ(smoothed(three, kPoint).world_from_ct[1]->translation_mm, three[1].world_from_ct->translation_mm);
    track[3].sigma = 0;
    EXPECT_THROW((void)smoothed(track, kPoint), Error);
}

TEST(Jitter, IsTheNoiseOfASteadyMotion) {
    constexpr double kSigma_mm = 0.3, kSigma_rad = 0.01;
    const TrackJitter jitter = jitter_of(noisy(400, kSigma_mm, kSigma_rad), kPoint);
    EXPECT_EQ(jitter.count, 398U);
    EXPECT_NEAR(jitter.translation_mm, kSigma_mm, 0.1 * kSigma_mm);  // 400 frames tell it to 5 %
    EXPECT_NEAR(jitter.rotation_deg, kSigma_rad * 180 / std::numbers::pi, 0.1 * kSigma_rad * 180 / std::numbers::pi);
}

}  // namespace
}  // namespace raylign::detail
