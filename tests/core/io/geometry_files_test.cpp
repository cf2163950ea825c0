#include <gmock/gmock.h>

#include "geometry_texts.h"
#include "io_files.h"
#include "raylign/io/geometry.h"
#include "raylign/io/views.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::kMayaCam2;
using test::kRtkDistances;
using test::replaced;
using test::rtk;
using test::views_json;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class GeometryFiles : public test::IoTest {};

const std::string kOpencv = R"(%YAML:1.0
---
image_width: 120
image_height: 100
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 2000., 0., 61., 0., 2100., 48., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0., 0., 0., 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 0., 0., 1., -1., 0., 0., 0., -1., 0. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ 5., -7., 9.0000000000000000e+02 ]
)";

TEST_F(GeometryFiles, OpencvYamlSaysTheSameAsMayaCam2) {
    const ViewGeometry a = read_geometry(write("a.yml", kOpencv)).front().geometry;
    const ViewGeometry b = read_geometry(write("b.txt", kMayaCam2)).front().geometry;
    EXPECT_LT((projection_matrix(a) - projection_matrix(b)).norm(), 1e-9);
    EXPECT_EQ(a.camera.size_px, b.camera.size_px);
}

TEST_F(GeometryFiles, OpencvRotationVectorIsRead) {
    const std::string vector = replaced(
        kOpencv,
        "R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 0., 0., 1., -1., 0., 0., 0., -1., 0. ]",
        "rvec: [ 0., 0., 1.5707963267948966 ]");
    const ViewGeometry view = read_geometry(write("a.yaml", vector)).front().geometry;
    Eigen::Matrix3d expected;
    expected << 0, -1, 0, 1, 0, 0, 0, 0, 1;
    EXPECT_LT((view.camera_from_world.rotation - expected).norm(), 1e-12);
}

TEST_F(GeometryFiles, OpencvFaultsAreNamed) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_geometry(write("a.yml", text)); });
    };
    EXPECT_THAT(message(replaced(kOpencv, "camera_matrix", "matrix")), HasSubstr("camera_matrix or K"));
    EXPECT_THAT(message(replaced(kOpencv, "T: ", "S: ")), HasSubstr("T or tvec"));
    EXPECT_THAT(message(replaced(kOpencv, "61., ", "")), HasSubstr("rows x cols"));
    EXPECT_THAT(message(replaced(kOpencv, "61.", ".Nan")), HasSubstr("finite number"));
    EXPECT_THAT(message(replaced(kOpencv, "image_width: 120\n", "")), HasSubstr("image_width"));
    EXPECT_THAT(message("%YAML:1.0\n---\nT: [1, 2\n"), HasSubstr("not valid YAML"));
    EXPECT_THAT(message("<?xml version=\"1.0\"?>\n<opencv_storage></opencv_storage>\n"), HasSubstr("YAML"));
}

TEST_F(GeometryFiles, AnythingElseIsRefusedByName) {
    const auto message = [&](const std::string& name, const std::string& text) {
        return error_of([&] { (void)read_geometry(write(name, text)); });
    };
    EXPECT_THAT(message("a.txt", "hello\n"), AllOf(HasSubstr("a.txt"), HasSubstr("MayaCam")));
    EXPECT_THAT(message("a.txt", ""), HasSubstr("empty"));
    EXPECT_THAT(message("a.txt", std::string(2000, '\0')), HasSubstr("no text file"));
    EXPECT_THAT(message("a.yml", "%YAML:1.0\n" + std::string(2 << 20, '1')), HasSubstr("at most 1 MB"));
    EXPECT_THAT(message("a.txt", std::string("i\0m\0", 4)), HasSubstr("UTF-16"));
    EXPECT_THAT(error_of([&] { (void)read_geometry(at("none.txt")); }), HasSubstr("does not exist"));
}

TEST_F(GeometryFiles, ViewsJsonNamesAGeometryFile) {
    (void)write("cam.txt", kMayaCam2);
    const auto path =
        write("views.json", R"({"raylign": 1, "views": [{"name": "A", "geometry": "cam.txt", "sdd_mm": 1400}]})");
    const ViewsFile file = read_views(path, ReadImages::never);
    EXPECT_EQ(file.views[0].geometry.camera.size_px, Eigen::Vector2i(120, 100));
    EXPECT_EQ(file.views[0].geometry.camera.sdd_mm, 1400);
    EXPECT_THAT(file.notes, Contains(AllOf(HasSubstr("A: "), HasSubstr("MayaCam 2"))));
    EXPECT_THAT(file.files, Contains(at("cam.txt")));
}

TEST_F(GeometryFiles, ViewsJsonGivesWhatTheFileLacks) {
    (void)write("g.xml", rtk(kRtkDistances + "<GantryAngle>0</GantryAngle>"));
    const auto views = [&](const std::string& keys) {
        return write("views.json", R"({"raylign": 1, "views": [{"name": "A", "geometry": "g.xml")" + keys + "}]}");
    };
    EXPECT_NO_THROW((void)read_views(views(R"(, "size_px": [120, 100], "pixel_pitch_mm": [2, 3], "projection": 1)"),
                                     ReadImages::never));
    EXPECT_THAT(error_of([&] { (void)read_views(views(R"(, "size_px": [120, 100])"), ReadImages::never); }),
                HasSubstr("pixel_pitch_mm"));
    EXPECT_THAT(error_of([&] { (void)read_views(views(R"(, "flip": "both")"), ReadImages::never); }),
                AllOf(HasSubstr("views[0].flip"), HasSubstr("columns")));
    EXPECT_THAT(error_of([&] { (void)read_views(views(R"(, "projection": 1.5)"), ReadImages::never); }),
                HasSubstr("views[0].projection"));
}

TEST_F(GeometryFiles, AMirroredProjectionMatrixIsNotedAndTurnedOnRequest) {
    // Columns run to -x, rows to +y, depth along +z from (0, 0, -900): left-handed.
    const std::string view = R"({"name": "A", "size_px": [120, 100],
        "projection_matrix": [[-2000, 0, 60, 54000], [0, 2000, 50, 45000], [0, 0, 1, 900]])";
    const ViewsFile plain = read_views(write("a.json", views_json(view + "}")), ReadImages::never);
    EXPECT_THAT(plain.notes, Contains(AllOf(HasSubstr("behind the source"), HasSubstr("flip"))));
    const ViewsFile turned =
        read_views(write("b.json", views_json(view + R"(, "flip": "columns"})")), ReadImages::never);
    EXPECT_LT((project(turned.views[0].geometry, {9, 0, 0}) - Eigen::Vector2d(119 - (60 - 20), 50)).norm(), 1e-9);
    EXPECT_EQ(turned.origins[0].flip, ImageFlip::columns);
    EXPECT_THAT(turned.notes, testing::Not(Contains(HasSubstr("behind the source"))));
}

TEST_F(GeometryFiles, AWorldWhoseOriginIsTheSourceIsNotMirrored) {
    const std::string view = R"({"name": "A", "size_px": [120, 100],
        "projection_matrix": [[2000, 0, 60, 0], [0, 2000, 50, 0], [0, 0, 1, 0]]})";
    EXPECT_THAT(read_views(write("a.json", views_json(view)), ReadImages::never).notes,
                testing::Not(Contains(HasSubstr("behind the source"))));
}

TEST_F(GeometryFiles, TextsOfOtherSystemsAreRead) {
    const ViewGeometry plain = read_geometry(write("a.txt", kMayaCam2)).front().geometry;
    std::string windows = "\xEF\xBB\xBF";
    for (const char c : kMayaCam2) windows += c == '\n' ? std::string("\r\n") : std::string(1, c == ',' ? '\t' : c);
    EXPECT_EQ(projection_matrix(read_geometry(write("b.txt", windows)).front().geometry), projection_matrix(plain));
    EXPECT_EQ(projection_matrix(read_geometry(write("c.yml", "\xEF\xBB\xBF" + kOpencv)).front().geometry),
              projection_matrix(read_geometry(write("d.yml", kOpencv)).front().geometry));
}

TEST_F(GeometryFiles, FramesAreWholeNumbersFromOne) {
    for (const char* frame : {"0", "1.5", "1e300", "\"2\""}) {
        const auto path = write("f.json", R"({"raylign": 1, "views": [{"name": "A", "geometry": "x", "frame": )" +
                                              std::string(frame) + "}]}");
        EXPECT_THAT(error_of([&] { (void)read_views(path, ReadImages::never); }), HasSubstr("views[0].frame")) << frame;
    }
}

TEST_F(GeometryFiles, FilesAreViewsByThemselves) {
    const std::vector<std::string> files{write("one.txt", kMayaCam2), write("two cam.yml", kOpencv)};
    const ViewsFile file = read_views(files, ReadImages::never);
    ASSERT_EQ(file.views.size(), 2U);
    EXPECT_EQ(file.views[0].name, "one");
    EXPECT_EQ(file.views[1].name, "two_cam");
    EXPECT_THAT(error_of([&] {
                    (void)read_views(std::vector<std::string>{files[0], files[0]}, ReadImages::never);
                }),
                HasSubstr("different from the other views' names"));
    EXPECT_THAT(error_of([&] { (void)read_views(files, ReadImages::required); }), HasSubstr("an X-ray is needed"));
}

}  // namespace
}  // namespace raylign::detail
