#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "io_files.h"
#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/trajectory.h"
#include "tests/support/test_data.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class JointTrackCalibration : public IoTest {};

TEST_F(JointTrackCalibration, ProjectsAsItsSourceDoes) {
    const GeometryHints size{.size_px = Eigen::Vector2i(200, 100)};
    const auto view = read_geometry(write("c.txt", "JT_INTCALIB\n1000\n10\n-5\n0.5\n"), size).front();
    EXPECT_EQ(view.flip, ImageFlip::none);
    EXPECT_DOUBLE_EQ(view.geometry.camera.sdd_mm.value(), 1000);
    EXPECT_LT(source_world_mm(view.geometry).norm(), 1e-12);
    // (10, 20, -1000): column 100 + (10 + 10) / 0.5, row 50 + (-5 + 20) / 0.5 = 80 counted upwards from the last, 99.
    const Eigen::Vector2d pixel = project(view.geometry, {10, 20, -1000});
    EXPECT_NEAR(pixel.x(), 140, 1e-9);
    EXPECT_NEAR(pixel.y(), 19, 1e-9);
    const auto one_line = read_geometry(write("d.txt", "JTA_INTCALIB 1000, 10 -5\t0.5"), size).front();
    EXPECT_EQ(one_line.geometry.camera.intrinsics_px, view.geometry.camera.intrinsics_px);
}

TEST_F(JointTrackCalibration, SaysWhatIsMissingOrWrong) {
    const GeometryHints size{.size_px = Eigen::Vector2i(200, 100)};
    const auto message = [&](const std::string& text, const GeometryHints& hints) {
        return error_of([&] { (void)read_geometry(write("bad.txt", text), hints); });
    };
    EXPECT_THAT(message("JT_INTCALIB\n1000\n0\n0\n0.5\n", {}), HasSubstr("size_px"));
    EXPECT_THAT(message("JT_INTCALIB\n1000\n0\n0\n", size), HasSubstr("numbers of the calibration = 3"));
    EXPECT_THAT(message("JT_INTCALIB\n1000\n0\n0\n0\n", size), AllOf(HasSubstr("pixel size"), HasSubstr("positive")));
    EXPECT_THAT(message("JT_INTCALIB\n1000\nx\n0\n1\n", size), AllOf(HasSubstr("x offset"), HasSubstr("\"x\"")));
    EXPECT_THAT(message("JTA_INTCALIB_BIPLANE\n1\n2\n3\n4\n", size), HasSubstr("one plane"));
    GeometryHints foreign = size;
    foreign.sdd_mm = 900;
    EXPECT_THAT(message("JT_INTCALIB\n1000\n0\n0\n0.5\n", foreign), HasSubstr("sdd_mm"));
}

/// Share of the points of a real implant's surface that fall on its dark image, and of those beside it.
TEST_F(JointTrackCalibration, TheRealImplantsLieOnTheirImages) {
    const auto data = test_data() / "knee";
    RAYLIGN_NEED_DATA(data / "calibration.txt");
    const auto xray = read_xray(data / "AT_K1_V1_0160.tif").image;
    const auto view =
        read_geometry(data / "calibration.txt", {.size_px = Eigen::Vector2i(xray.width, xray.height)}).front();
    std::ifstream model(data / "KR_right_7_fem.stl");
    const RigidTransform pose = *read_jointtrack_poses(data / "fem.jts").frames[0].world_from_ct;
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = -low;
    int dark = 0, all = 0;
    std::string word;
    while (model >> word) {
        Eigen::Vector3d vertex;
        if (word != "vertex" || !(model >> vertex.x() >> vertex.y() >> vertex.z())) continue;
        const Eigen::Vector2d pixel = project(view.geometry, pose * vertex);
        low = low.cwiseMin(pixel);
        high = high.cwiseMax(pixel);
        const auto at = static_cast<std::size_t>(std::lround(pixel.y()) * xray.width + std::lround(pixel.x()));
        dark += xray.pixels.at(at) < 110;
        ++all;
    }
    ASSERT_GT(all, 10000);
    EXPECT_GT(dark, 0.9 * all) << "of " << all;
    // The box of the metal in the image: where the grey is midway between metal and what lies beside it.
    EXPECT_LT((low - Eigen::Vector2d(454, 311)).cwiseAbs().maxCoeff(), 2);
    EXPECT_LT((high - Eigen::Vector2d(644, 533)).cwiseAbs().maxCoeff(), 2);
}

}  // namespace
}  // namespace raylign::detail::test
