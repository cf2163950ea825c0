#include "apps/track/gaps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "raylign/camera.h"
#include "raylign/phantom.h"

namespace raylign::detail::apps {
namespace {

constexpr int kFrames = 60;
constexpr double kSigma_mm = 2, kTold_mm = 4;  // told as more: no frame shall contradict the others

/// A cube around this point of the CT.
TrackObject cube(const std::string& name, const Eigen::Vector3d& centre_ct_mm) {
    TrackObject object{name, {}, {}, {}, {}};
    object.volume.grid = centred_grid({3, 3, 3}, {10, 10, 10});
    object.volume.grid.origin_mm += centre_ct_mm;
    object.volume.attenuation_per_mm.assign(27, 0.05F);
    return object;
}

/// Two objects in one view, 40 mm behind one another and off its axis, each seen in its true place but for depth.
class Gaps : public testing::Test {
protected:
    Gaps() {
        inputs.objects = {cube("femur", {60, 0, 0}), cube("tibia", {-60, 20, 0})};
        View view;
        view.geometry.camera = camera_from_pitch({256, 256}, 1200, {1, 1}, {127.5, 127.5});
        inputs.views.views = {view};
        Random random(7);
        for (int frame = 1; frame <= kFrames; ++frame) {
            for (std::size_t o = 0; o < 2; ++o) {
                TrackFrame found;
                found.frame = frame;
                found.status = TrackStatus::ok;
                const Eigen::Vector3d centre_mm = truth_mm(o, frame);
                const Eigen::Vector3d off_mm = kSigma_mm * random.normal() * centre_mm.normalized();
                found.world_from_ct = RigidTransform::translate(centre_mm + off_mm - centre_ct_mm(o));
                found.expected_in_plane_mm = 0.1;
                found.expected_in_depth_mm = kTold_mm;
                rows.push_back({inputs.objects[o].name, found});
            }
        }
    }
    [[nodiscard]] Eigen::Vector3d centre_ct_mm(std::size_t object) const {
        return inputs.objects[object].volume.grid.centre_ct_mm();
    }
    [[nodiscard]] Eigen::Vector3d truth_mm(std::size_t object, int frame) const {
        return centre_ct_mm(object) + Eigen::Vector3d(0.3 * frame, 0, 900 + 40.0 * static_cast<double>(object));
    }
    [[nodiscard]] double rms_off_mm(const std::vector<TrajectoryRow>& of) const {
        double squares = 0;
        for (std::size_t i = 0; i < of.size(); ++i) {
            const Eigen::Vector3d at_mm = of[i].frame.world_from_ct * centre_ct_mm(i % 2);
            squares += (at_mm - truth_mm(i % 2, of[i].frame.frame)).squaredNorm();
        }
        return std::sqrt(squares / static_cast<double>(of.size()));
    }

    TrackInputs inputs;
    std::vector<TrajectoryRow> rows;
    std::vector<std::string> notes;
};

TEST_F(Gaps, DepthsGetBetterAndPlacesInTheImageStay) {
    const std::vector<TrajectoryRow> held = rows_with_gaps_held(rows, inputs, 0.2, notes);
    EXPECT_LT(rms_off_mm(held), 0.8 * rms_off_mm(rows));
    const ViewGeometry& view = inputs.views.views.front().geometry;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Eigen::Vector2d before = project(view, rows[i].frame.world_from_ct * centre_ct_mm(i % 2));
        const Eigen::Vector2d after = project(view, held[i].frame.world_from_ct * centre_ct_mm(i % 2));
        EXPECT_LT((before - after).norm(), 1e-9);
        EXPECT_LT(held[i].frame.expected_in_depth_mm, kTold_mm);
        EXPECT_NEAR(held[i].frame.expected_error_mm, std::hypot(0.1, held[i].frame.expected_in_depth_mm), 1e-12);
    }
    EXPECT_THAT(notes.back(), testing::HasSubstr("120 of 120 rows were moved"));
}

TEST_F(Gaps, FramesThatAreNotOkStayAsTheyAre) {
    rows[10].frame.status = TrackStatus::doubtful;
    const std::vector<TrajectoryRow> held = rows_with_gaps_held(rows, inputs, 0.2, notes);
    for (const std::size_t i : {10, 11}) {
        EXPECT_EQ(held[i].frame.world_from_ct.translation_mm, rows[i].frame.world_from_ct.translation_mm);
        EXPECT_EQ(held[i].frame.expected_in_depth_mm, kTold_mm);
    }
}

TEST_F(Gaps, JointsNameThePairs) {
    inputs.objects.push_back(cube("patella", {0, 0, 0}));
    inputs.joints = {{0, 2}};  // which no frame shows
    const std::vector<TrajectoryRow> held = rows_with_gaps_held(rows, inputs, 0.2, notes);
    EXPECT_EQ(rms_off_mm(held), rms_off_mm(rows));
    EXPECT_THAT(notes.back(), testing::HasSubstr("0 of 120 rows"));
}

}  // namespace
}  // namespace raylign::detail::apps
