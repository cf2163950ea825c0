#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "core/io/images/counts.h"
#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/views.h"
#include "views_text.h"

namespace raylign::detail {
namespace {

using test::kCameraView;
using test::replaced;
using test::views_json;
using testing::Contains;
using testing::HasSubstr;

class ViewsIo : public test::IoTest {
protected:
    ViewsFile read(const std::string& views, ReadImages images = ReadImages::never) {
        return read_views(write("views.json", views_json(views)), images);
    }
};

Eigen::Matrix<double, 3, 4> expected_projection() {
    Eigen::Matrix<double, 3, 4> p;  // K [I | (0, 0, 1000)] with fx = 750, fy = 500, c = (3, 2.5)
    p << 750, 0, 3, 3000, 0, 500, 2.5, 2500, 0, 0, 1, 1000;
    return p;
}

void expect_projection(const ViewGeometry& geometry, const Eigen::Matrix<double, 3, 4>& expected) {
    EXPECT_LT((projection_matrix(geometry) - expected).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(geometry.camera.size_px, Eigen::Vector2i(8, 6));
}

TEST_F(ViewsIo, CameraFormIsRead) {
    const ViewsFile file = read(kCameraView);
    ASSERT_EQ(file.views.size(), 1U);
    EXPECT_EQ(file.views[0].name, "AP");
    expect_projection(file.views[0].geometry, expected_projection());
    EXPECT_EQ(file.views[0].geometry.camera.sdd_mm, 1500);
    EXPECT_TRUE(file.views[0].image.empty());
    EXPECT_EQ(file.files, std::vector{at("views.json")});
}

TEST_F(ViewsIo, MissingPrincipalPointIsTheMiddleAndNoted) {
    const ViewsFile file = read(replaced(kCameraView, R"(, "principal_point_px": [3, 2.5])", ""));
    EXPECT_EQ(file.views[0].geometry.camera.intrinsics_px(0, 2), 3.5);
    EXPECT_EQ(file.views[0].geometry.camera.intrinsics_px(1, 2), 2.5);
    EXPECT_THAT(file.notes, Contains(HasSubstr("views[0].camera.principal_point_px")));
}

TEST_F(ViewsIo, ProjectionMatrixFormIsReadAtAnyScale) {
    const ViewsFile file = read(R"({"name": "P", "size_px": [8, 6],
        "projection_matrix": [[-1500,0,-6,-6000],[0,-1000,-5,-5000],[0,0,-2,-2000]]})");
    expect_projection(file.views[0].geometry, expected_projection());
    EXPECT_FALSE(file.views[0].geometry.camera.sdd_mm.has_value());
}

TEST_F(ViewsIo, IntrinsicsFormIsRead) {
    const ViewsFile file = read(R"({"name": "K", "size_px": [8, 6], "intrinsics": [[750,0,3],[0,500,2.5],[0,0,1]],
        "sdd_mm": 1500, "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,1000],[0,0,0,1]]})");
    expect_projection(file.views[0].geometry, expected_projection());
    EXPECT_EQ(file.views[0].geometry.camera.sdd_mm, 1500);
}

TEST_F(ViewsIo, CArmFormIsRead) {
    const ViewsFile file = read(R"({"name": "C", "c_arm": {"sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 30,
        "secondary_angle_deg": -10, "pixel_pitch_mm": [2, 3], "size_px": [8, 6]}})");
    const ViewGeometry expected = view_from_c_arm({.sad_mm = 1000,
                                                   .sdd_mm = 1500,
                                                   .primary_angle_deg = 30,
                                                   .secondary_angle_deg = -10,
                                                   .pixel_pitch_mm = {2, 3},
                                                   .size_px = {8, 6}});
    expect_projection(file.views[0].geometry, projection_matrix(expected));
}

TEST_F(ViewsIo, SizeMayComeFromTheImageWhereTheFormAllowsIt) {
    write_image(at("a.tif"), Image(8, 6, 1));
    const ViewsFile file = read(R"({"name": "P", "image": "a.tif",
        "projection_matrix": [[750,0,3,3000],[0,500,2.5,2500],[0,0,1,1000]]})",
                                ReadImages::required);
    expect_projection(file.views[0].geometry, expected_projection());
}

TEST_F(ViewsIo, ImageAndMaskAreReadRelativeToTheFile) {
    std::filesystem::create_directory(at("sub"));
    Image image(8, 6, 1), mask(8, 6, 7);
    image(2, 3) = 5;
    image(4, 4) = std::numeric_limits<float>::quiet_NaN();
    mask(1, 1) = 0;
    write_image(at("sub/a.tif"), image);
    write_image(at("sub/m.mha"), mask);
    const ViewsFile file = read(
        replaced(kCameraView, R"("AP",)", R"("AP", "image": "sub/a.tif", "mask": "sub/m.mha",)"), ReadImages::required);
    EXPECT_EQ(file.views[0].image(2, 3), 5);
    EXPECT_EQ(file.views[0].weights(1, 1), 0);
    EXPECT_EQ(file.views[0].weights(2, 3), 1);
    EXPECT_EQ(file.views[0].weights(4, 4), 0);
    EXPECT_EQ(file.files, (std::vector{at("views.json"), at("sub/a.tif"), at("sub/m.mha")}));
    EXPECT_THAT(file.notes, Contains(HasSubstr("AP: kind: line integral")));
}

TEST_F(ViewsIo, IntensitySettingsAreUsed) {
    write_image(at("a.tif"), Image(8, 6, 50));
    const std::string intensity =
        R"("AP", "image": "a.tif", "intensity": {"kind": "transmission", "i0": 200, "polarity": "bone-dark"},)";
    const ViewsFile file = read(replaced(kCameraView, R"("AP",)", intensity), ReadImages::required);
    EXPECT_NEAR(file.views[0].image(0, 0), std::log(4.0), 1e-6);
}

TEST_F(ViewsIo, GeometryOnlyReadsNoImage) {
    const std::string view = replaced(kCameraView, R"("AP",)", R"("AP", "image": "none.tif", "mask": "none.png",)");
    EXPECT_TRUE(read(view, ReadImages::never).views[0].image.empty());
}

TEST_F(ViewsIo, ImageIsOptionalIfNamed) { EXPECT_TRUE(read(kCameraView, ReadImages::if_named).views[0].image.empty()); }

TEST_F(ViewsIo, WrittenViewsReadBackTheSame) {
    const ViewGeometry c_arm = view_from_c_arm({.sad_mm = 742.5,
                                                .sdd_mm = 1198.1,
                                                .primary_angle_deg = 33.3,
                                                .secondary_angle_deg = 11.1,
                                                .pixel_pitch_mm = {0.3, 0.31},
                                                .size_px = {8, 6}});
    ViewGeometry bare = c_arm;
    bare.camera.sdd_mm.reset();
    write_image(at("drr_A.tif"), Image(8, 6, 2));
    write_image(at("drr_B.tif"), Image(8, 6, 3));
    write_views(at("out.json"), {{"A", c_arm, {}, {}}, {"B", bare, {}, {}}}, {"drr_A.tif", "drr_B.tif"});
    const ViewsFile file = read_views(at("out.json"), ReadImages::required);
    ASSERT_EQ(file.views.size(), 2U);
    expect_projection(file.views[0].geometry, projection_matrix(c_arm));
    EXPECT_EQ(file.views[0].geometry.camera.intrinsics_px, c_arm.camera.intrinsics_px);
    EXPECT_EQ(file.views[0].geometry.camera.sdd_mm, 1198.1);
    EXPECT_FALSE(file.views[1].geometry.camera.sdd_mm.has_value());
    EXPECT_EQ(file.views[1].image(0, 0), 3);
}

TEST_F(ViewsIo, CountsAreWrittenWithHowToReadThem) {
    Image counts(8, 6, 1000);
    counts(2, 1) = 500;
    write_counts(at("counts.tif"), counts, 1023);
    IntensitySettings intensity;
    intensity.kind = IntensityKind::transmission;
    intensity.polarity = Polarity::bone_dark;
    intensity.i0 = 1000;
    intensity.auto_mask = true;
    View view{"A", read(kCameraView).views[0].geometry, {}, {}};
    view.geometry.camera.size_px = {8, 6};
    write_views(at("out.json"), {view}, {"counts.tif"}, intensity);
    const ViewsFile file = read_views(at("out.json"), ReadImages::required);
    EXPECT_NEAR(file.views[0].image(2, 1), std::log(2.0), 1e-6);
    EXPECT_EQ(file.views[0].image(0, 0), 0);
    EXPECT_TRUE(file.origins[0].intensity.auto_mask);
    EXPECT_EQ(file.origins[0].intensity.polarity, Polarity::bone_dark);
    counts(2, 1) = 0.5F;
    EXPECT_THAT(test::error_of([&] { write_counts(at("counts.tif"), counts, 1023); }),
                HasSubstr("count 10 = 0.500000"));
}

TEST_F(ViewsIo, ViewsWithoutImagesAreWrittenToo) {
    write_views(at("out.json"), {{"A", read(kCameraView).views[0].geometry, {}, {}}}, {}, {ImageFlip::rows});
    const ViewsFile file = read_views(at("out.json"), ReadImages::never);
    expect_projection(file.views[0].geometry, expected_projection());
    EXPECT_EQ(file.origins[0].flip, ImageFlip::rows);
}

}  // namespace
}  // namespace raylign::detail
