#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/images/raster.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "tests/apps/run_program.h"
#include "tests/support/test_data.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kJts =
    "JT_EULER_312\n x_tran, y_tran, z_tran, z_rot, x_rot, y_rot\n"
    "1, 2, -1000, 90, 0, 0\n4, 5, -1001, 91, 2, 3\n";

/// A volume of 4 x 3 x 2 voxels; its place does not matter to what is written in its own frame.
void write_tiff_volume(const std::filesystem::path& path) {
    Raster raster;
    raster.format = FileFormat::tiff;
    raster.size = {4, 3, 2};
    raster.spacing_mm = {1, 1, 1};
    raster.origin_mm = {0, 0, 0};
    raster.direction = Eigen::MatrixXd::Identity(3, 3);
    raster.type = PixelType::u8;
    raster.bytes.resize(24);
    write_raster(path, raster);
}

class PosesCommand : public testing::Test {
protected:
    void SetUp() override {
        write_text_file(folder.path("fem.jts"), kJts);
        write_tiff_volume(folder.path("femur.tif"));
        write_text_file(
            folder.path("trial.cfg"),
            "Version 1.1\nmayaCam_csv cam1.txt\nCameraRootDir cam1\nVolumeFile femur.tif\nVolumeFlip 1 0 0\n"
            "VoxelSize 0.5 1 2\nRenderResolution 512 512\n");
    }
    ProgramResult poses(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "poses");
        return run_raylign(arguments);
    }
    TestFolder folder;
};

TEST_F(PosesCommand, TakesOnePoseOut) {
    const ProgramResult result = poses({folder.path("fem.jts"), "--frame", "1", "-o", folder.path("pose.json")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    // A quarter turn about z.
    const Eigen::Vector3d x = read_pose(folder.path("pose.json")) * Eigen::Vector3d(10, 20, 30);
    EXPECT_LT((x - Eigen::Vector3d(-19, 12, -970)).norm(), 1e-9) << x.transpose();
}

TEST_F(PosesCommand, OpenSimGetsTimeTurnsInDegreesAndMetres) {
    write_text_file(folder.path("gap.jts"), std::string(kJts) +
                                                "NOT_OPTIMIZED, NOT_OPTIMIZED, NOT_OPTIMIZED, NOT_OPTIMIZED, "
                                                "NOT_OPTIMIZED, NOT_OPTIMIZED\n");
    const std::string mot = folder.path("knee.mot");
    ASSERT_EQ(poses({folder.path("gap.jts"), "--object", "femur", "--rate", "50", "-o", mot}).exit_code, 0);
    const std::string text = read_text(mot);
    EXPECT_THAT(text, testing::StartsWith("knee\nversion=1\nnRows=3\nnColumns=7\ninDegrees=yes\nendheader\n"
                                          "time\tfemur_rx\tfemur_ry\tfemur_rz\tfemur_tx\tfemur_ty\tfemur_tz\n0\t"));
    EXPECT_THAT(text, HasSubstr("\t90\t0.001\t0.002\t-1\n0.02\t"));  // a quarter turn about z
    EXPECT_THAT(text, testing::EndsWith("\n0.04\tnan\tnan\tnan\tnan\tnan\tnan\n"));
    const std::string trc = folder.path("knee.trc");
    ASSERT_EQ(poses({folder.path("gap.jts"), "--object", "femur", "--rate", "50", "-o", trc}).exit_code, 0);
    const std::string markers = read_text(trc);
    EXPECT_THAT(markers, testing::StartsWith("PathFileType\t4\t(X/Y/Z)\tknee.trc\n"));
    EXPECT_THAT(markers, HasSubstr("\n50\t50\t3\t4\tmm\t50\t1\t3\nFrame#\tTime\tfemur_o\t\t\tfemur_x"));
    EXPECT_THAT(markers, HasSubstr("\n1\t0\t1\t2\t-1000\t"));
    EXPECT_THAT(markers, testing::EndsWith("\n3\t0.04" + std::string(12, '\t') + "\n"));
    const ProgramResult untimed = poses({folder.path("gap.jts"), "-o", mot});
    EXPECT_EQ(untimed.exit_code, 2);
    EXPECT_THAT(untimed.err, HasSubstr("--rate"));
}

TEST_F(PosesCommand, APoseOfADicomCtIsWrittenInDicom) {
    const auto ct = test_data() / "pelvis" / "dicom";
    RAYLIGN_NEED_DATA(ct);
    const ProgramResult result =
        poses({folder.path("fem.jts"), "--frame", "2", "--volume", ct.string(), "-o", folder.path("pose.dcm")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto expected = read_jointtrack_poses(folder.path("fem.jts")).frames[1].world_from_ct;
    const RigidTransform written = read_pose(folder.path("pose.dcm"), ct / names_in(ct).front());
    EXPECT_LT((to_matrix(written) - to_matrix(*expected)).cwiseAbs().maxCoeff(), 1e-9);
    ASSERT_EQ(poses({folder.path("pose.dcm"), "-o", folder.path("pose.json")}).exit_code, 0);
    EXPECT_LT((to_matrix(read_pose(folder.path("pose.json"))) - to_matrix(*expected)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST_F(PosesCommand, ConvertsThroughEveryFormatAndBack) {
    std::string last = folder.path("fem.jts");
    const std::vector<std::vector<std::string>> steps = {
        {"a.csv", "--object", "femur"},
        {"b.tra", "--volume", folder.path("femur.tif"), "--spacing", "0.5,1,2"},
        {"c.csv", "--trial", folder.path("trial.cfg"), "--format", "xmalab"},
        {"d.jtak"},
        {"e.csv"}};
    for (const std::vector<std::string>& step : steps) {
        std::vector<std::string> arguments{last, "-o", folder.path(step[0])};
        arguments.insert(arguments.end(), step.begin() + 1, step.end());
        const ProgramResult result = poses(arguments);
        ASSERT_EQ(result.exit_code, 0) << step[0] << ": " << result.err;
        last = folder.path(step[0]);
    }
    const auto expected = read_jointtrack_poses(folder.path("fem.jts"));
    const auto rows = read_trajectory(last);
    ASSERT_EQ(rows.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_LT((to_matrix(rows[i].frame.world_from_ct) - to_matrix(*expected.frames[i].world_from_ct)).norm(), 1e-9);
    }
    EXPECT_THAT(read_text(folder.path("c.csv")), testing::StartsWith("femur_R11,"));
}

TEST_F(PosesCommand, FaultsAreUsageErrors) {
    const auto message = [&](const std::vector<std::string>& arguments) {
        const ProgramResult result = poses(arguments);
        EXPECT_EQ(result.exit_code, 2);
        return result.err;
    };
    const std::string jts = folder.path("fem.jts");
    EXPECT_THAT(message({jts, "-o", folder.path("a.json")}), HasSubstr("choose by --frame N"));
    EXPECT_THAT(message({jts, "-o", folder.path("a.json"), "--frame", "3"}), HasSubstr("in [1, 2]"));
    EXPECT_THAT(message({jts, "-o", folder.path("a.tra")}), HasSubstr("--volume"));
    EXPECT_THAT(message({jts, "-o", folder.path("a.xyz")}), HasSubstr(".jtak"));
    const std::string dcm = folder.path("a.dcm"), tiff = folder.path("femur.tif");
    EXPECT_THAT(message({jts, "-o", dcm}), HasSubstr("choose by --frame N"));
    EXPECT_THAT(message({jts, "--frame", "1", "-o", dcm}), AllOf(HasSubstr("CT in DICOM"), HasSubstr("--volume")));
    EXPECT_THAT(message({jts, "--frame", "1", "-o", dcm, "--volume", tiff, "--spacing", "1,1,1"}),
                AllOf(HasSubstr("femur.tif"), HasSubstr("is no DICOM file")));
    EXPECT_THAT(message({jts, "-o", folder.path("a.csv"), "--format", "maya"}), HasSubstr("xmalab"));
    EXPECT_THAT(message({jts, "-o", jts}), HasSubstr("overwrite"));
    EXPECT_THAT(message({jts, "-o", folder.path("a.csv"), "--order", "up"}), HasSubstr("rows or columns"));
    EXPECT_THAT(message({jts, "-o", folder.path("a.csv"), "--unit", "0"}), HasSubstr("--unit"));
    write_text_file(folder.path("x.tra"), "1,2,3,4,5,6\n");
    EXPECT_THAT(message({folder.path("x.tra"), "-o", folder.path("a.csv")}), HasSubstr("--trial"));
    EXPECT_THAT(message({folder.path("x.tra"), "-o", folder.path("a.csv"), "--volume", folder.path("femur.tif")}),
                HasSubstr("--spacing"));
    EXPECT_FALSE(std::filesystem::exists(folder.path("a.csv")));
}

}  // namespace
}  // namespace raylign::detail::test
