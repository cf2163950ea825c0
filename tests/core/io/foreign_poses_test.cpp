#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/io/poses/pose_file.h"
#include "io_files.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ForeignPoses : public IoTest {
protected:
    /// The world point of a point of the object in the frame of this place in the list.
    [[nodiscard]] static Eigen::Vector3d moved(const PoseSequence& sequence, std::size_t place,
                                               const Eigen::Vector3d& x) {
        return sequence.frames.at(place).world_from_ct.value() * x;
    }
    static void expect_near(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        EXPECT_LT((a - b).norm(), 1e-9) << a.transpose() << " and " << b.transpose();
    }
};

/// Voxel (0, 0, 0) is at (-3, 4, 100) in ct and at (0.25, 14.625, -0.75) in Autoscoper's frame of the volume.
VoxelGrid tra_grid() {
    VoxelGrid grid;
    grid.size = {10, 20, 30};
    grid.spacing_mm = {0.5, 0.75, 1.5};
    grid.origin_mm = {-3, 4, 100};
    return grid;
}
const Eigen::Vector3d kFirstVoxel(-3, 4, 100);

TEST_F(ForeignPoses, TraMovesTheVolumesCornerFrameInEveryFormOfTheFile) {
    const std::vector<VoxelGrid> grids{tra_grid()};
    // A quarter turn about z: (0.25, 14.625, -0.75) goes to (-14.625, 0.25, -0.75), and on by (5, 6, 7).
    const Eigen::Vector3d expected(-9.625, 6.25, 6.25);
    const std::string nan = "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN\n";
    for (const std::string& text : {
             std::string("0,-1,0,5,1,0,0,6,0,0,1,7,0,0,0,1\n") + nan,  // by rows
             std::string("0 -1 0 5 1 0 0 6 0 0 1 7 0 0 0 1\r\n") + nan,
             std::string("0,1,0,0,-1,0,0,0,0,0,1,0,5,6,7,1\n") + nan,  // by columns
             std::string("5,6,7,90,0,0\nNaN,NaN,NaN,NaN,NaN,NaN\n"),   // x, y, z, yaw, pitch, roll
             std::string("5 6 7 90 0 0 \nNaN NaN NaN NaN NaN NaN\n"),
         }) {
        const auto read = read_tra(write("a.tra", text), grids);
        ASSERT_EQ(read.size(), 1U);
        ASSERT_EQ(read[0].frames.size(), 2U);
        expect_near(moved(read[0], 0, kFirstVoxel), expected);
        EXPECT_FALSE(read[0].frames[1].world_from_ct) << text;
        EXPECT_EQ(read[0].frames[1].frame, 2);
    }
}

TEST_F(ForeignPoses, YawPitchRollTurnAboutZThenTheNewYThenTheNewX) {
    const std::vector<VoxelGrid> grids{tra_grid()};
    const auto read = read_tra(write("a.tra", "5,6,7,90,90,0\n5,6,7,90,90,90\n"), grids).front();
    // Ry (x, y, z) = (z, y, -x) and Rz (x, y, z) = (-y, x, z) at 90 degrees, Rx (x, y, z) = (x, -z, y).
    expect_near(moved(read, 0, kFirstVoxel), {-14.625 + 5, -0.75 + 6, -0.25 + 7});
    expect_near(moved(read, 1, kFirstVoxel), {-0.75 + 5, 14.625 + 6, -0.25 + 7});
}

TEST_F(ForeignPoses, TraOfSeveralVolumesHasThemSideBySide) {
    VoxelGrid other = tra_grid();
    other.origin_mm = {0, 0, 0};
    const std::vector<VoxelGrid> grids{tra_grid(), other};
    const auto read = read_tra(write("a.tra", "0,0,0,0,0,0,1,2,3,0,0,0\n"), grids);
    ASSERT_EQ(read.size(), 2U);
    expect_near(moved(read[0], 0, kFirstVoxel), {0.25, 14.625, -0.75});
    expect_near(moved(read[1], 0, {0, 0, 0}), {1.25, 16.625, 2.25});
}

TEST_F(ForeignPoses, TraInCentimetresAndWithAGivenOrder) {
    const std::vector<VoxelGrid> grids{tra_grid()};
    const auto path = write("a.tra", "1,0,0,0.5,0,1,0,0.6,0,0,1,0.7,0,0,0,1\n");
    expect_near(moved(read_tra(path, grids, {.order = {}, .unit_mm = 10}).front(), 0, kFirstVoxel),
                {0.25 + 5, 14.625 + 6, -0.75 + 7});
    // A turn alone fits both orders: rows are taken unless told otherwise.
    const auto turn = write("turn.tra", "0,-1,0,0,1,0,0,0,0,0,1,0,0,0,0,1\n");
    expect_near(moved(read_tra(turn, grids).front(), 0, kFirstVoxel), {-14.625, 0.25, -0.75});
    expect_near(moved(read_tra(turn, grids, {.order = MatrixOrder::columns, .unit_mm = 1}).front(), 0, kFirstVoxel),
                {14.625, -0.25, -0.75});
}

TEST_F(ForeignPoses, WhatIsWrittenAsTraReadsBack) {
    const RigidTransform pose = exp((Twist() << 0.3, -0.2, 0.5, 10, -20, 30).finished());
    const std::vector<std::optional<RigidTransform>> poses{pose, std::nullopt};
    const std::vector<VoxelGrid> grids{tra_grid()};
    const auto read = read_tra(write("a.tra", tra_text(poses, tra_grid())), grids).front();
    EXPECT_LT((to_matrix(*read.frames[0].world_from_ct) - to_matrix(pose)).norm(), 1e-12);
    EXPECT_FALSE(read.frames[1].world_from_ct);
}

TEST_F(ForeignPoses, BadTraFilesAreRefusedByLine) {
    const std::vector<VoxelGrid> grids{tra_grid()};
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_tra(write("bad.tra", text), grids); });
    };
    EXPECT_THAT(message("1,2,3\n"), AllOf(HasSubstr("numbers in a line = 3"), HasSubstr("bad.tra")));
    EXPECT_THAT(message("0,0,0,0,0,0\n0,0,0,0,0\n"), AllOf(HasSubstr("line 2"), HasSubstr("as in the first, 6")));
    EXPECT_THAT(message("0,0,0,0,0,x\n"), AllOf(HasSubstr("line 1"), HasSubstr("\"x\"")));
    EXPECT_THAT(message("2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1\n"), HasSubstr("line 1"));
    EXPECT_THAT(message("1,0,0,5,0,1,0,0,0,0,1,0,4,0,0,1\n"), HasSubstr("neither row by row nor column by column"));
    EXPECT_THAT(message(" \n"), HasSubstr("no text"));
    EXPECT_THAT(error_of([&] { (void)read_tra(write("a.tra", "0,0,0,0,0,0\n"), {}); }), HasSubstr("needs the volume"));
}

const std::string kJtsTitles = "          x_tran,          y_tran,   z_tran,   z_rot,   x_rot,    y_rot\n";

TEST_F(ForeignPoses, JointTrackTurnsAboutYThenXThenZ) {
    const auto path = write("fem.jts", "JT_EULER_312\n" + kJtsTitles +
                                           "1, 2, -1000, 90, 0, 0\n1, 2, -1000, 90, 90, 0\n1,2,-1000,90,90,90\n"
                                           "NOT_OPTIMIZED,NOT_OPTIMIZED,,,,\n");
    const PoseSequence read = read_jointtrack_poses(path);
    ASSERT_EQ(read.frames.size(), 4U);
    // At 90 degrees: Rz (x, y, z) = (-y, x, z), Rx (x, y, z) = (x, -z, y), Ry (x, y, z) = (z, y, -x).
    expect_near(moved(read, 0, {10, 20, 30}), {-19, 12, -970});
    expect_near(moved(read, 1, {10, 20, 30}), {30 + 1, 10 + 2, 20 - 1000});
    expect_near(moved(read, 2, {10, 20, 30}), {-10 + 1, 30 + 2, 20 - 1000});
    EXPECT_FALSE(read.frames[3].world_from_ct);
}

TEST_F(ForeignPoses, WhatIsWrittenForJointTrackReadsBack) {
    PoseSequence sequence{"femur", {{1, std::nullopt}, {2, std::nullopt}}};
    for (const Twist& twist : {(Twist() << 0.3, -1.2, 2.5, 10, -20, -1030).finished(),
                               (Twist() << -0.1, 0.2, 0.05, 1, 2, -900).finished()}) {
        sequence.frames.push_back({static_cast<int>(sequence.frames.size()) + 1, exp(twist)});
    }
    for (const auto& [name, flavour] :
         {std::pair("a.jts", JointTrackFlavour::jts), {"a.jtak", JointTrackFlavour::jtak}}) {
        const PoseSequence read = read_jointtrack_poses(write(name, jointtrack_text(sequence, flavour)));
        ASSERT_EQ(read.frames.size(), 4U);
        for (std::size_t i = 0; i < 4; ++i) {
            ASSERT_EQ(read.frames[i].world_from_ct.has_value(), i >= 2);
            if (i < 2) continue;
            EXPECT_LT((to_matrix(*read.frames[i].world_from_ct) - to_matrix(*sequence.frames[i].world_from_ct)).norm(),
                      1e-10);
        }
    }
}

TEST_F(ForeignPoses, APoseAtTheEndOfTheXAngleIsWrittenAsItIs) {
    const PoseSequence up{"",
                          {{1, exp((Twist() << std::acos(0.0), 0, 0, 0, 0, 0).finished()) *
                                   exp((Twist() << 0, 0.4, 0, 1, 2, 3).finished())}}};
    const PoseSequence read = read_jointtrack_poses(write("up.jts", jointtrack_text(up, JointTrackFlavour::jts)));
    EXPECT_LT((to_matrix(*read.frames[0].world_from_ct) - to_matrix(*up.frames[0].world_from_ct)).norm(), 1e-7);
}

TEST_F(ForeignPoses, BadJointTrackFilesAreRefusedByLine) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_jointtrack_poses(write("bad.jts", text)); });
    };
    EXPECT_THAT(message("JT_EULER_123\n" + kJtsTitles + "1,2,3,4,5,6\n"), HasSubstr("JT_EULER_312"));
    EXPECT_THAT(message("JT_EULER_312\nx_tran,y_tran,z_tran,x_rot,y_rot,z_rot\n1,2,3,4,5,6\n"), HasSubstr("line 2"));
    EXPECT_THAT(message("JT_EULER_312\n" + kJtsTitles + "1,2,3,4,5\n"),
                AllOf(HasSubstr("line 3"), HasSubstr("columns")));
    EXPECT_THAT(message("JT_EULER_312\n" + kJtsTitles), HasSubstr("no poses"));
}

TEST_F(ForeignPoses, AJointTrackFileWithOnePoseIsAPose) {
    const auto one = write("one.jts", "JT_EULER_312\n" + kJtsTitles + "1, 2, -1000, 90, 0, 0\n");
    expect_near(read_pose(one) * Eigen::Vector3d(10, 20, 30), {-19, 12, -970});
    const auto two = write("two.jts", "JT_EULER_312\n" + kJtsTitles + "1,2,3,4,5,6\n1,2,3,4,5,6\n");
    EXPECT_THAT(error_of([&] { (void)read_pose(two); }), HasSubstr("--frame N -o pose.json"));
}

TEST_F(ForeignPoses, XmalabWritesMatricesColumnByColumn) {
    // A quarter turn about z, then (5, 6, 7).
    const std::string row = "0,1,0,0,-1,0,0,0,0,0,1,0,5,6,7,1";
    const std::string gap = "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN";
    const auto plain = read_xmalab_bodies(write("a.csv", row + "\n" + gap + "\n"));
    ASSERT_EQ(plain.size(), 1U);
    expect_near(moved(plain[0], 0, {10, 20, 30}), {-15, 16, 37});
    EXPECT_FALSE(plain[0].frames[1].world_from_ct);

    std::string heading = "Frame";
    for (const std::string body : {"hip_left", "knee"}) {
        for (const char* cell : {"_R11", "_R12", "_R13", "_01", "_R21", "_R22", "_R23", "_02", "_R31", "_R32", "_R33",
                                 "_03", "_TX", "_TY", "_TZ", "_1"}) {
            heading += " , " + body + cell;
        }
    }
    const auto both =
        read_xmalab_bodies(write("b.csv", heading + "\n12," + row + "," + gap + "\n13," + gap + "," + row), 10);
    ASSERT_EQ(both.size(), 2U);
    EXPECT_EQ(both[0].object, "hip_left");
    EXPECT_EQ(both[1].object, "knee");
    EXPECT_EQ(both[0].frames[1].frame, 13);
    EXPECT_FALSE(both[1].frames[0].world_from_ct);
    expect_near(moved(both[1], 1, {10, 20, 30}), {-20 + 50, 10 + 60, 30 + 70});
}

TEST_F(ForeignPoses, WhatIsWrittenForXmalabReadsBack) {
    const RigidTransform pose = exp((Twist() << 0.3, -0.2, 0.5, 10, -20, 30).finished());
    const std::vector<PoseSequence> bodies{{"radius", {{1, pose}, {2, std::nullopt}}},
                                           {"ulna", {{1, std::nullopt}, {2, inverse(pose)}}}};
    const std::string text = xmalab_text(bodies);
    EXPECT_TRUE(text.starts_with("radius_R11,radius_R12,radius_R13,radius_01,"));
    const auto read = read_xmalab_bodies(write("a.csv", text));
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read[1].object, "ulna");
    EXPECT_LT((to_matrix(*read[0].frames[0].world_from_ct) - to_matrix(pose)).norm(), 1e-12);
    EXPECT_LT((to_matrix(*read[1].frames[1].world_from_ct) - to_matrix(inverse(pose))).norm(), 1e-12);
    EXPECT_FALSE(read[1].frames[0].world_from_ct);
}

TEST_F(ForeignPoses, BadXmalabTablesAreRefused) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_xmalab_bodies(write("bad.csv", text)); });
    };
    EXPECT_THAT(message("1,2,3\n4,5,6\n"), AllOf(HasSubstr("columns = 3"), HasSubstr("16 for each")));
    EXPECT_THAT(message("1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1\n"),
                AllOf(HasSubstr("line 1"), HasSubstr("column by column")));
    EXPECT_THAT(message("0,1,0,0,-1,0,0,0,0,0,1,0,5,6,7,1\n0,1\n"), HasSubstr("line 2"));
}

TEST_F(ForeignPoses, FilesAreToldApart) {
    EXPECT_EQ(pose_file_format("a.TRA"), PoseFileFormat::tra);
    EXPECT_EQ(pose_file_format("a.jtak"), PoseFileFormat::jointtrack);
    EXPECT_EQ(pose_file_format("a.json"), PoseFileFormat::single);
    EXPECT_EQ(pose_file_format(write("x.csv", "1,2,3")), PoseFileFormat::xmalab);
    EXPECT_EQ(pose_file_format(write("t.csv", trajectory_header({}))), PoseFileFormat::trajectory);
}

TEST_F(ForeignPoses, ATrajectoryOfThemReadsBackAsTheSamePoses) {
    const RigidTransform pose = exp((Twist() << 0.3, -0.2, 0.5, 10, -20, 30).finished());
    const std::vector<PoseSequence> bodies{{"radius", {{4, pose}, {5, std::nullopt}}}, {"ulna", {{4, inverse(pose)}}}};
    std::string text = trajectory_header({});
    for (const TrajectoryRow& row : trajectory_rows(bodies)) text += trajectory_line(row, 0);
    const auto read = read_pose_file(write("t.csv", text));
    ASSERT_EQ(read.size(), 2U);
    EXPECT_EQ(read[0].object, "radius");
    EXPECT_EQ(read[0].frames[1].frame, 5);
    EXPECT_FALSE(read[0].frames[1].world_from_ct);
    EXPECT_LT((to_matrix(*read[1].frames[0].world_from_ct) - to_matrix(inverse(pose))).norm(), 1e-12);
}

}  // namespace
}  // namespace raylign::detail::test
