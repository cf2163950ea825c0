#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/io/datasets/datasets.h"
#include "core/io/files/output.h"
#include "dataset_files.h"
#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "tests/support/hdf5_writer.h"

namespace raylign::detail::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A small file with the layout of DiffDRR's ljubljana.h5.
class Ljubljana : public IoTest {
protected:
    void SetUp() override {
        IoTest::SetUp();
        const Hdf5Writer file(at("l.h5"));
        std::vector<std::int16_t> voxels(24);
        std::iota(voxels.begin(), voxels.end(), std::int16_t{0});
        file.array("subject03/volume/pixels", {4, 2, 3}, voxels);  // x, y, z
        file.array("subject03/volume/spacing", {3}, std::vector<double>{0.5, 1, 2});
        file.array("subject03/volume/origin", {3}, std::vector<double>{10, 20, 30});
        file.matrix("subject03/points", Eigen::Matrix<double, 2, 3>{{13, 24, 5}, {1, 2, 3}});
        for (const std::string view : {"ap", "lat", "ap-max"}) {
            const std::string group = "subject03/proj-" + view + "/";
            file.array(group + "pixels", {2, 3}, std::vector<float>{0, 1, 2, 3, 4, 9});
            file.matrix(group + "intrinsic", Eigen::Matrix3d{{-2000, 0, 30}, {0, -2000, 20}, {0, 0, 1}});
            file.matrix(group + "extrinsic", rigid(quarter_turn_about_z(), {1, 2, -608}));
            file.number(group + "col-spacing", 0.5);
            file.number(group + "row-spacing", 0.5);
        }
    }
};

TEST_F(Ljubljana, VolumePixelsAndGeometryAreAsItsLoadersHaveThem) {
    {
        OutputFolder folder(at("case"));
        (void)write_case(read_ljubljana(at("l.h5"), {.case_name = "3", .views = {}, .border_px = {}, .i0 = {}}),
                         folder);
        folder.commit();
    }
    const Raster volume = read_raster(at("case") / "ct.mha");
    EXPECT_THAT(volume.size, ElementsAre(4, 2, 3));
    EXPECT_THAT(volume.origin_mm, ElementsAre(10, 20, 30));
    EXPECT_THAT(volume.spacing_mm, ElementsAre(0.5, 1, 2));
    const auto* voxels = reinterpret_cast<const std::int16_t*>(volume.bytes.data());
    EXPECT_EQ(voxels[0], 18) << "stored (3, 0, 0): x is reversed";
    EXPECT_EQ(voxels[1], 12) << "x is fastest";
    EXPECT_EQ(voxels[4], 21) << "then y";
    EXPECT_EQ(voxels[8], 19) << "then z";
    const Image image = read_xray(at("case") / "ap.tif").image;
    EXPECT_NEAR(image.pixels[0], std::log(10.0), 1e-6);
    EXPECT_NEAR(image.pixels[4], std::log(10.0) - std::log(5.0), 1e-6);
    const ViewsFile views = read_views(at("case") / "views.json", ReadImages::never);
    ASSERT_EQ(views.views.size(), 2U) << "the maxima over time only where they are asked for";
    // (13, 24, 5) turned and moved: (-24 + 1, 13 + 2, 5 - 608).
    const Eigen::Vector2d pixel =
        project(views.views[0].geometry, read_pose(at("case") / "pose_ap_vessels.json") * kLandmark);
    EXPECT_NEAR(3 - 1 - pixel.x(), 30 + 2000 * -23 / 603.0, 1e-6);
    EXPECT_NEAR(pixel.y(), 20 + 2000 * 15 / 603.0, 1e-6);
    EXPECT_EQ(read_targets(at("case") / "targets.json").size(), 2U);
}

TEST_F(Ljubljana, ChoicesAndFaultsAreToldInWords) {
    const auto message = [&](const std::string& patient, const std::vector<std::string>& views) {
        return error_of([&] {
            (void)read_ljubljana(at("l.h5"), {.case_name = patient, .views = views, .border_px = {}, .i0 = {}});
        });
    };
    EXPECT_NO_THROW(
        (void)read_ljubljana(at("l.h5"), {.case_name = "subject03", .views = {"ap-max"}, .border_px = {}, .i0 = {}}));
    EXPECT_THAT(message("4", {}), HasSubstr("one of subject03"));
    EXPECT_THAT(message("", {"pa"}), HasSubstr("one of ap, ap-max, lat"));
    {
        const Hdf5Writer other(at("o.h5"));
        other.number("x", 1.0);
    }
    EXPECT_THAT(error_of([&] { (void)read_ljubljana(at("o.h5"), {}); }), HasSubstr("no group subjectNN"));
}

}  // namespace
}  // namespace raylign::detail::test
