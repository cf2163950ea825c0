#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "core/io/images/raster.h"
#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "raylign/io/views.h"
#include "tests/apps/track/track_case.h"

namespace raylign::detail::test {
namespace {

using testing::HasSubstr;

/// The femur of TrackCase as an Autoscoper trial: a TIFF that is stored with its columns reversed, two MayaCam files,
/// two folders of images.
class Trial : public testing::Test {
protected:
    void SetUp() override {
        const Raster volume = read_raster(folder.path("femur.mha"));
        origin_mm = {volume.origin_mm[0], volume.origin_mm[1], volume.origin_mm[2]};
        Raster reversed = volume;
        reversed.format = FileFormat::tiff;
        const auto width = static_cast<std::size_t>(volume.size[0]);
        for (std::size_t i = 0; i < volume.pixel_count(); ++i) {
            const std::size_t from = i - i % width + (width - 1 - i % width);
            std::memcpy(reversed.bytes.data() + 4 * i, volume.bytes.data() + 4 * from, 4);
        }
        write_raster(folder.path("femur.tif"), reversed);
        std::string cfg = "# a trial\nVersion 1.1\n";
        const ViewsFile views = read_views(folder.path("geometry.json"), ReadImages::never);
        for (std::size_t v = 0; v < views.views.size(); ++v) {
            const std::string name = "cam" + std::to_string(v + 1);
            write_text_file(folder.path(name + ".txt"), mayacam2_text(views.views[v].geometry));
            cfg += "mayaCam_csv " + name + ".txt\nCameraRootDir .\\" + name + "\n";
            std::filesystem::create_directory(folder.path(name));
            for (int frame = 1; frame <= 2; ++frame) {
                write_image(folder.path(name + "/x." + std::to_string(frame + 6) + ".tif"),
                            scene.xray(v, frame, false));
            }
        }
        write_text_file(folder.path("trial.cfg"), cfg +
                                                      "VolumeFile femur.tif\nVolumeFlip 1 0 0\nVoxelSize 1.8 1.8 1.8\n"
                                                      "RenderResolution 512 512\nOptimizationOffsets 0 0 0 0 0 0\n");
        write_pose(folder.path("start.json"), read_pose(folder.path("f.json")) * shown());
    }
    /// ct of the case from ct of the shown volume, whose first voxel is its origin.
    [[nodiscard]] RigidTransform shown() const { return RigidTransform::translate(origin_mm); }

    TestFolder folder;
    TrackCase scene{folder};
    Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
};

TEST_F(Trial, BringsCamerasFramesAndFlippedVolumes) {
    const ProgramResult result =
        run_raylign({"track", "--views", folder.path("trial.cfg"), "--attenuation", "--start",
                     folder.path("start.json"), "--recover", "none", "-o", folder.path("track")});
    ASSERT_LE(result.exit_code, 1) << result.err;
    const auto rows = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(rows.size(), 2U);
    EXPECT_EQ(rows[0].object, "femur");
    EXPECT_EQ(rows[0].frame.frame, 7) << "by the names of the images";
    for (int frame = 1; frame <= 2; ++frame) {
        const RigidTransform truth = scene.femur(frame) * shown();
        const RigidTransform& found = rows[static_cast<std::size_t>(frame) - 1].frame.world_from_ct;
        const Eigen::Vector3d centre = inverse(shown()) * TrackCase::kFemurCentre;
        EXPECT_LT((found * centre - truth * centre).norm(), 0.5) << frame;
        EXPECT_LT(rotation_angle_rad(inverse(truth) * found), 0.01) << frame;
    }
    // Autoscoper's own corner frame of the shown volume: voxel (0, 0, 0) at (0.9, 36 * 1.8 - 0.9, -0.9).
    const std::string tra = read_text(folder.path("track/femur.tra"));
    double m[12];
    std::istringstream cells(tra);
    for (double& cell : m) {
        cells >> cell;
        cells.ignore();
    }
    const Eigen::Vector3d corner(0.9, 36 * 1.8 - 0.9, -0.9);
    const Eigen::Vector3d by_tra(m[0] * corner.x() + m[1] * corner.y() + m[2] * corner.z() + m[3],
                                 m[4] * corner.x() + m[5] * corner.y() + m[6] * corner.z() + m[7],
                                 m[8] * corner.x() + m[9] * corner.y() + m[10] * corner.z() + m[11]);
    EXPECT_LT((by_tra - rows[0].frame.world_from_ct.translation_mm).norm(), 1e-6);
}

TEST_F(Trial, StartsFromTheRowOfItsFirstFrame) {
    const RigidTransform pose = read_pose(folder.path("start.json"));
    const PoseSequence poses{"femur", {{1, std::nullopt}, {2, pose}}};
    write_text_file(folder.path("two.jts"), jointtrack_text(poses, JointTrackFlavour::jts));
    ASSERT_EQ(run_raylign(
                  {"poses", folder.path("two.jts"), "--trial", folder.path("trial.cfg"), "-o", folder.path("two.tra")})
                  .exit_code,
              0);
    const std::vector<std::string> track{
        "track", "--views", folder.path("trial.cfg"), "--attenuation", "--start", folder.path("two.tra"), "--recover",
        "none",  "-o",      folder.path("track")};
    const ProgramResult first = run_raylign(track);
    EXPECT_EQ(first.exit_code, 2);
    EXPECT_THAT(first.err, HasSubstr("no pose for the first frame, 7 (its row 1)"));
    std::vector<std::string> second = track;
    second.insert(second.end(), {"--first", "8"});
    const ProgramResult result = run_raylign(second);
    EXPECT_LE(result.exit_code, 1) << result.err;
    EXPECT_EQ(read_trajectory(folder.path("track/trajectory.csv")).at(0).frame.frame, 8);
}

TEST_F(Trial, ItsCamerasAreViewsOfOtherCommands) {
    const ProgramResult result = run_raylign({"geometry", folder.path("trial.cfg"), "-o", folder.path("views.json")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("Autoscoper trial"));
    const ViewsFile views = read_views(folder.path("views.json"), ReadImages::never);
    ASSERT_EQ(views.views.size(), 2U);
    EXPECT_EQ(views.views[1].name, "cam2");
    const ProgramResult instant = run_raylign({"register", "-v", folder.path("femur.mha"), "--attenuation", "--views",
                                               folder.path("trial.cfg"), "-o", folder.path("result")});
    EXPECT_EQ(instant.exit_code, 2);
    EXPECT_THAT(instant.err, HasSubstr("has 2 images, and one instant is needed"));
}

TEST_F(Trial, VolumesThatAutoscoperDoesNotReadAreRefused) {
    write_text_file(folder.path("other.cfg"),
                    "mayaCam_csv cam1.txt\nCameraRootDir cam1\nVolumeFile femur.mha\nVoxelSize 1 1 1\n");
    const ProgramResult result =
        run_raylign({"track", "--views", folder.path("other.cfg"), "-o", folder.path("track")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("a multi-page TIFF"));
}

TEST_F(Trial, FaultsNameTheLine) {
    const auto message = [&](const std::string& text) {
        write_text_file(folder.path("bad.cfg"), text);
        const ProgramResult result = run_raylign({"geometry", folder.path("bad.cfg")});
        EXPECT_EQ(result.exit_code, 2);
        return result.err;
    };
    const std::string good = "mayaCam_csv cam1.txt\nCameraRootDir cam1\n";
    EXPECT_THAT(message(good + "VolumeSize 1 1 1\n"), HasSubstr("line 3"));
    EXPECT_THAT(message(good + "CameraRootDir cam2\n"), HasSubstr("as many as mayaCam_csv, 1"));
    EXPECT_THAT(message(good + "VolumeFile a.tif\n"), HasSubstr("as many as VolumeFile, 1"));
    EXPECT_THAT(message(good + "VolumeFile a.tif\nVoxelSize 0 1 1\n"), HasSubstr("(0, 1000] mm"));
    EXPECT_THAT(message("mayaCam_csv none.txt\nCameraRootDir cam1\n"), HasSubstr("none.txt"));
}

}  // namespace
}  // namespace raylign::detail::test
