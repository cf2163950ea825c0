#include <gmock/gmock.h>

#include <sstream>

#include "io_files.h"
#include "raylign/io/geometry.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class VectorTables : public test::IoTest {};

const GeometryHints kDetectorSize{.size_px = Eigen::Vector2i(101, 81)};

// Source on -y, detector on +y, columns along x, rows along -z: as seen from the source.
const std::string kConeVec = "0 -700 0  0 300 0  0.5 0 0  0 0 -0.4\n";

TEST_F(VectorTables, AstrasConeVecIsRead) {
    const GeometryView view = read_geometry(write("a.txt", kConeVec), kDetectorSize).front();
    EXPECT_EQ(geometry_format_of(at("a.txt")), GeometryFormat::vectors);
    EXPECT_EQ(view.flip, ImageFlip::none);
    EXPECT_NEAR(*view.geometry.camera.sdd_mm, 1000, 1e-9);
    EXPECT_LT((*view.geometry.camera.pixel_pitch_mm() - Eigen::Vector2d(0.5, 0.4)).norm(), 1e-9);
    EXPECT_LT((source_world_mm(view.geometry) - Eigen::Vector3d(0, -700, 0)).norm(), 1e-9);
    // The middle of 101 x 81 pixels is (50, 40); magnification 1000 / 700.
    EXPECT_LT((project(view.geometry, Eigen::Vector3d::Zero()) - Eigen::Vector2d(50, 40)).norm(), 1e-9);
    EXPECT_LT((project(view.geometry, {7, 0, 14}) - Eigen::Vector2d(50 + 10 / 0.5, 40 - 20 / 0.4)).norm(), 1e-9);
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("image's middle")));
}

TEST_F(VectorTables, FiveRowsOfConeVecAreNoMayaCam) {
    std::string rows;
    for (int i = 0; i < 5; ++i) rows += "0,-700," + std::to_string(i) + ",0,300,0,0.5,0,0,0,0,-0.4\n";
    const std::vector<GeometryView> views = read_geometry(write("five.txt", rows), kDetectorSize);
    ASSERT_EQ(views.size(), 5U);
    EXPECT_EQ(views[4].name, "five_5");
    EXPECT_LT((source_world_mm(views[4].geometry) - Eigen::Vector3d(0, -700, 4)).norm(), 1e-9);
    GeometryHints third = kDetectorSize;
    third.item = 3;
    EXPECT_EQ(read_geometry(at("five.txt"), third).front().name, "five_3");
}

TEST_F(VectorTables, AHeadingNamesTheColumnsInAnyOrder) {
    const std::string text =
        "Name;Rows;Columns;Right X [mm];Right Y [mm];Right Z [mm];down_x;down_y;down_z;Source_X;Source_Y;Source_Z;"
        "detector_origin_x_mm;detector_origin_y_mm;detector_origin_z_mm\n"
        "AP;81;101;0.5;0;0;0;0;-0.4;0;-700;0;-25;300;16\n";
    const GeometryView view = read_geometry(write("b.csv", text)).front();
    EXPECT_EQ(view.name, "AP");
    EXPECT_EQ(view.geometry.camera.size_px, Eigen::Vector2i(101, 81));
    const GeometryView cone = read_geometry(write("a.txt", kConeVec), kDetectorSize).front();
    EXPECT_LT((projection_matrix(view.geometry) - projection_matrix(cone.geometry)).norm(), 1e-9);
}

TEST_F(VectorTables, AMirroredDetectorIsRefusedAndTurnedOnRequest) {
    const auto path = write("m.txt", "0 -700 0 0 300 0 0.5 0 0 0 0 0.4\n");
    EXPECT_THAT(error_of([&] { (void)read_geometry(path, kDetectorSize); }),
                AllOf(HasSubstr("mirrored"), HasSubstr("flip")));
    GeometryHints rows = kDetectorSize;
    rows.flip = ImageFlip::rows;
    EXPECT_LT((project(read_geometry(path, rows).front().geometry, {7, 0, 14}) - Eigen::Vector2d(70, -10)).norm(),
              1e-9);
}

TEST_F(VectorTables, FaultsAreNamedByLine) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_geometry(write("bad.csv", text), kDetectorSize); });
    };
    EXPECT_THAT(message(kConeVec + "1 2 3\n"), AllOf(HasSubstr("bad.csv, line 2"), HasSubstr("12")));
    EXPECT_THAT(message(kConeVec + "0 -700 0 0 300 0 0.5 0 0 0 0 x\n"), AllOf(HasSubstr("line 2"), HasSubstr("x")));
    EXPECT_THAT(message("0 0 0 0 0 0 1 0 0 0 1 0\n"), HasSubstr("source must not lie on the detector"));
    EXPECT_THAT(message("0 -700 0 0 300 0 1 0 0 2 0 0\n"), HasSubstr("two directions"));
    EXPECT_THAT(message("source_x,source_y,source_z,weight\n1,2,3,4\n"), HasSubstr("column = weight"));
    EXPECT_THAT(message("source_x,source_y,source_z\n1,2,3\n"), HasSubstr("must name x, y and z of source"));
    EXPECT_THAT(error_of([&] { (void)read_geometry(write("a.txt", kConeVec)); }), HasSubstr("size"));
}

TEST_F(VectorTables, ManyViewsRoundTrip) {
    std::vector<ViewGeometry> views;
    std::vector<std::string> names;
    for (int i = 0; i < 7; ++i) {
        ViewGeometry view = view_from_c_arm({.sad_mm = 780,
                                             .sdd_mm = 1180,
                                             .primary_angle_deg = 33.0 * i,
                                             .secondary_angle_deg = -17,
                                             .pixel_pitch_mm = {2.9, 2.1},
                                             .size_px = {61, 84},
                                             .principal_point_px = Eigen::Vector2d(33.25, 39.75)});
        view.camera.intrinsics_px(0, 1) = 0.5 * i;  // skewed pixels have a place here
        views.push_back(view);
        names.push_back("v" + std::to_string(i));
    }
    const std::vector<GeometryView> back = read_geometry(write("out.csv", vectors_text(views, names)));
    ASSERT_EQ(back.size(), views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        EXPECT_EQ(back[i].name, names[i]);
        EXPECT_EQ(back[i].geometry.camera.size_px, views[i].camera.size_px);
        EXPECT_NEAR(*back[i].geometry.camera.sdd_mm, 1180, 1e-9);
        const auto expected = projection_matrix(views[i]);
        EXPECT_LT((projection_matrix(back[i].geometry) - expected).norm() / expected.norm(), 1e-12);
    }
    views[0].camera.sdd_mm.reset();
    EXPECT_THAT(error_of([&] { (void)vectors_text(views, names); }), HasSubstr("sdd_mm"));
}

std::vector<std::string> doubts(double sdd_mm, double pitch_mm, int side_px = 512) {
    return geometry_doubts(
        {camera_from_pitch({side_px, side_px}, sdd_mm, {pitch_mm, pitch_mm}, Eigen::Vector2d::Constant(side_px / 2.0)),
         RigidTransform::translate({0, 0, 700})});
}

TEST(GeometryDoubts, UsualRoomsHaveNone) {
    EXPECT_THAT(doubts(1536, 0.8), testing::IsEmpty());
    EXPECT_THAT(doubts(1000, 0.15, 2048), testing::IsEmpty());
    EXPECT_THAT(doubts(200, 0.05, 1024), testing::IsEmpty());
    EXPECT_THAT(doubts(1500, 6, 64), testing::IsEmpty());
}

TEST(GeometryDoubts, SlipsOfTheUnitAreNamed) {
    EXPECT_THAT(doubts(1.536, 0.8), AllOf(Contains(AllOf(HasSubstr("1.536 mm"), HasSubstr("in metres?"))),
                                          Contains(HasSubstr("focal length"))));
    EXPECT_THAT(doubts(1536, 0.0008), Contains(AllOf(HasSubstr("8e-04 mm"), HasSubstr("in metres?"))));
    EXPECT_THAT(doubts(1536, 800), Contains(AllOf(HasSubstr("800 mm"), HasSubstr("in micrometres?"))));
    EXPECT_THAT(doubts(1536000, 0.8), Contains(AllOf(HasSubstr("1536000 mm"), HasSubstr("in micrometres?"))));
    ViewGeometry view = {camera_from_pitch({512, 512}, 1536, {0.8, 0.8}, {256, 256}),
                         RigidTransform::translate({0, 0, 0.7})};
    EXPECT_THAT(geometry_doubts(view),
                testing::ElementsAre(AllOf(HasSubstr("origin is 0.7 mm"), HasSubstr("in metres?"))));
    view.camera_from_world.translation_mm.setZero();
    EXPECT_THAT(geometry_doubts(view), testing::IsEmpty()) << "a camera's own frame";
    EXPECT_THAT(doubts(1536, 8), Contains(HasSubstr("image on the detector")));
}

TEST_F(VectorTables, ALargeRtkFileIsRead) {
    std::ostringstream text;
    text << "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n"
         << "<SourceToIsocenterDistance>1000</SourceToIsocenterDistance>\n"
         << "<SourceToDetectorDistance>1536</SourceToDetectorDistance>\n<!--" << std::string(2 << 20, ' ') << "-->\n";
    constexpr int kCount = 720;
    for (int i = 0; i < kCount; ++i) text << "<Projection><GantryAngle>" << 0.5 * i << "</GantryAngle></Projection>\n";
    text << "</RTKThreeDCircularGeometry>\n";
    GeometryHints hints = kDetectorSize;
    hints.pixel_pitch_mm = Eigen::Vector2d(1, 1);
    EXPECT_EQ(read_geometry(write("large.xml", text.str()), hints).size(), 720U);
    const std::string whole = text.str();
    const auto message = [&](const std::string& bytes) {
        return error_of([&] { (void)read_geometry(write("bad.xml", bytes), hints); });
    };
    EXPECT_THAT(message(whole.substr(0, whole.size() - 5)), AllOf(HasSubstr("not valid XML"), HasSubstr("line 7")));
    EXPECT_THAT(message("<RTKThreeDCircularGeometry version=\"3\"><A>" + std::string(1 << 20, '1') +
                        "</A></RTKThreeDCircularGeometry>"),
                HasSubstr("more than 4096 characters"));
    EXPECT_THAT(message(std::string("\xFF\xFE<\0", 4)), HasSubstr("UTF-16"));
    std::string many = "<RTKThreeDCircularGeometry version=\"3\">";
    for (int i = 0; i < 100001; ++i) many += "<Projection/>";
    EXPECT_THAT(message(many + "</RTKThreeDCircularGeometry>"), HasSubstr("more than 100000 projections"));
}

}  // namespace
}  // namespace raylign::detail
