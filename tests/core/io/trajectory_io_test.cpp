#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <sstream>

#include "io_files.h"
#include "raylign/io/trajectory.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class TrajectoryIo : public IoTest {};

std::vector<TrajectoryRow> some_rows() {
    TrackFrame found{.frame = 7, .status = TrackStatus::doubtful};
    found.world_from_ct = exp((Twist() << 0.3, -1.2, 2.5, 1.0 / 3, -4e-7, 123456.789).finished());
    found.jump_mm = 0.1;
    found.cost = 1.0 / 7;
    found.view_costs = {0.25, 1e-9};
    found.expected_error_mm = 0.3;
    found.searched = Search::near;
    found.recovered = true;
    found.reasons = {"a, \"quoted\" reason", "another one"};
    found.time_s = 0.012;
    const TrackFrame gap{.frame = 8, .status = TrackStatus::missing, .reasons = {"no frame"}};
    TrackFrame lost = found;
    lost.frame = 9;
    lost.status = TrackStatus::lost;
    return {{"radius", found}, {"radius", gap}, {"radius", lost}};
}

std::string text_of(const std::vector<TrajectoryRow>& rows) {
    const std::vector<std::string> views{"AP", "LAT"};
    std::string text = trajectory_header(views);
    for (const TrajectoryRow& row : rows) text += trajectory_line(row, views.size());
    return text;
}

TEST_F(TrajectoryIo, WhatIsWrittenReadsBack) {
    const auto rows = some_rows();
    std::vector<std::string> views;
    const auto read = read_trajectory(write("t.csv", text_of(rows)), &views);
    EXPECT_EQ(views, (std::vector<std::string>{"AP", "LAT"}));
    ASSERT_EQ(read.size(), 3u);
    const TrackFrame& a = rows[0].frame;
    const TrackFrame& b = read[0].frame;
    EXPECT_EQ(read[0].object, "radius");
    EXPECT_EQ(b.frame, 7);
    EXPECT_EQ(b.status, a.status);
    EXPECT_EQ(b.searched, a.searched);
    EXPECT_TRUE(b.recovered);
    EXPECT_LT((to_matrix(b.world_from_ct) - to_matrix(a.world_from_ct)).norm(), 1e-14);
    EXPECT_EQ(b.world_from_ct.translation_mm, a.world_from_ct.translation_mm) << "every digit";
    EXPECT_EQ(b.cost, a.cost);
    EXPECT_EQ(b.view_costs, a.view_costs);
    EXPECT_EQ(b.expected_error_mm, a.expected_error_mm);
    EXPECT_EQ(b.reasons, a.reasons);
    EXPECT_EQ(read[1].frame.status, TrackStatus::missing);
    EXPECT_FALSE(pose_of(read[1].frame));
    EXPECT_EQ(read[2].frame.status, TrackStatus::lost);
    EXPECT_FALSE(pose_of(read[2].frame)) << "a lost frame's pose is not given out";
    EXPECT_EQ(read[2].frame.reasons, a.reasons);
}

TEST_F(TrajectoryIo, ALineThatWasCutOffIsDropped) {
    const std::string text = text_of(some_rows());
    EXPECT_EQ(read_trajectory(write("cut.csv", text.substr(0, text.size() - 5))).size(), 2u);
    EXPECT_EQ(read_trajectory(write("head.csv", text.substr(0, text.find('\n') + 1))).size(), 0u);
}

TEST_F(TrajectoryIo, DamagedFilesAreRefusedByLine) {
    const std::string text = text_of(some_rows());
    const auto message = [&](const std::string& damaged) {
        return error_of([&] { (void)read_trajectory(write("bad.csv", damaged)); });
    };
    EXPECT_THAT(message("x,y\n1,2\n"), HasSubstr("not a trajectory"));
    EXPECT_THAT(message(text + "radius,10,ok\n"), AllOf(HasSubstr("line 5"), HasSubstr("columns")));
    std::string damaged = text;
    EXPECT_THAT(message(damaged.replace(damaged.find("doubtful"), 8, "splendid")),
                AllOf(HasSubstr("line 2"), HasSubstr("splendid")));
    damaged = text;
    EXPECT_THAT(message(damaged.replace(damaged.find("0.012"), 5, "many")), HasSubstr("many"));
    EXPECT_THAT(error_of([&] { (void)read_trajectory(at("none.csv")); }), HasSubstr("none.csv"));
}

TEST_F(TrajectoryIo, HeadersThatAreCutOrForeignAreRefused) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_trajectory(write("bad.csv", text)); });
    };
    const std::string header = trajectory_header(std::vector<std::string>{"AP"});
    std::string damaged = header;
    EXPECT_THAT(message(damaged.replace(damaged.find("cost_AP"), 7, "x")),
                AllOf(HasSubstr("column 15 = x"), HasSubstr("cost_VIEW")));
    EXPECT_THAT(message(header.substr(0, header.find("time_s")) + "\n"), HasSubstr("not a trajectory"));
    damaged = text_of(some_rows());
    EXPECT_THAT(message(damaged.replace(damaged.find("radius,7"), 8, "radius,1e300")),
                AllOf(HasSubstr("line 2"), HasSubstr("frame = 1e300")));
}

VoxelGrid grid() {
    VoxelGrid g;
    g.size = {10, 20, 30};
    g.spacing_mm = {0.5, 0.75, 1.5};
    g.origin_mm = {-3, 4, 100};
    return g;
}

TEST_F(TrajectoryIo, AutoscoperCountsRowsUpwardsAndSlicesBackwards) {
    const RigidTransform ct_from_aut = ct_from_autoscoper(grid());
    for (const Eigen::Vector3d& voxel :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(9, 19, 29), Eigen::Vector3d(2, 5, 11)}) {
        const Eigen::Vector3d aut(0.5 * (voxel.x() + 0.5), 0.75 * (20 - voxel.y() - 0.5), -1.5 * (voxel.z() + 0.5));
        EXPECT_LT((ct_from_aut * aut - grid().ct_from_voxel(voxel)).norm(), 1e-12);
    }
    EXPECT_NEAR(ct_from_aut.rotation.determinant(), 1, 1e-15);
}

TEST_F(TrajectoryIo, TraHasSixteenNumbersAFrameRowByRow) {
    const RigidTransform pose = exp((Twist() << 0.3, -0.2, 0.5, 10, -20, 30).finished());
    const std::vector<std::optional<RigidTransform>> poses{pose, std::nullopt, pose};
    std::istringstream lines(tra_text(poses, grid()));
    std::string line;
    std::vector<std::string> all;
    while (std::getline(lines, line)) all.push_back(line);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[0], all[2]);
    EXPECT_EQ(all[1], "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN");
    const Eigen::Matrix4d expected = to_matrix(pose * ct_from_autoscoper(grid()));
    std::istringstream numbers(all[0]);
    std::string cell;
    for (int i = 0; i < 16; ++i) {
        ASSERT_TRUE(std::getline(numbers, cell, ','));
        EXPECT_NEAR(std::stod(cell), expected(i / 4, i % 4), 1e-15) << i;
        EXPECT_EQ(cell.size() - cell.find('.') - 1, 16u) << "digits as Autoscoper writes them";
    }
    EXPECT_FALSE(std::getline(numbers, cell, ','));
}

TEST_F(TrajectoryIo, LeftHandedVolumesHaveNoTra) {
    VoxelGrid mirrored = grid();
    mirrored.direction(0, 0) = -1;
    EXPECT_THAT(error_of([&] { (void)tra_text({}, mirrored); }), HasSubstr("left-handed"));
}

}  // namespace
}  // namespace raylign::detail::test
