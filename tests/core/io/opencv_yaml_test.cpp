#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/geometry.h"
#include "raylign/io/views.h"
#include "views_text.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::replaced;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

/// An opencv-matrix.
std::string yaml_matrix(const std::string& name, int rows, int cols, const std::string& data) {
    return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) + "\n   cols: " + std::to_string(cols) +
           "\n   dt: d\n   data: [ " + data + " ]\n";
}

const std::string kHead = "%YAML:1.0\n---\nimage_width: 1024\nimage_height: 768\n";
const std::string kK = yaml_matrix("camera_matrix", 3, 3, "3200., 0., 500., 0., 3100., 380., 0., 0., 1.");
const std::string kR = yaml_matrix("R", 3, 3, "0., 0., -1., 0., 1., 0., 1., 0., 0.");
const std::string kT = yaml_matrix("T", 3, 1, "900., 10., 800.");

class OpencvFiles : public test::IoTest {
protected:
    [[nodiscard]] GeometryView read(const std::string& text, const GeometryHints& hints = {}) const {
        return read_geometry(write("a.yml", text), hints).front();
    }
    [[nodiscard]] std::string message(const std::string& text, const GeometryHints& hints = {}) const {
        return error_of([&] { (void)read(text, hints); });
    }
};

TEST_F(OpencvFiles, DistortionIsFoundUnderEveryName) {
    const std::string five = "-0.21, 0.09, 0.001, -0.002, 0.01";
    for (const std::string name : {"distortion_coefficients", "distortion_coeffs", "dist_coeffs", "distCoeffs", "D",
                                   "D1", "d", "dist", "Distortion_Coefficients", "distCoeffs1", "dist_coeffs_1"}) {
        for (const std::string& stated :
             {yaml_matrix(name, 1, 5, five), yaml_matrix(name, 5, 1, five), name + ": [" + five + "]\n"}) {
            const GeometryView view = read(kHead + kK + kR + kT + stated);
            ASSERT_TRUE(view.distortion) << stated;
            EXPECT_EQ(view.distortion->k1, -0.21);
            EXPECT_EQ(view.distortion->p2, -0.002);
            EXPECT_EQ(view.distortion->k3, 0.01);
            EXPECT_THAT(view.assumptions, Contains(AllOf(HasSubstr("undistorted on reading"), HasSubstr("k1 -0.21"))));
        }
    }
    const GeometryView scalars = read(kHead + kK + kR + kT + "k1: -0.2\nk2: 0.1\np1: 0.\np2: 0.01\n");
    ASSERT_TRUE(scalars.distortion);
    EXPECT_EQ(scalars.distortion->p2, 0.01);
    EXPECT_FALSE(read(kHead + kK + kR + kT + yaml_matrix("D", 1, 5, "0., 0., 0., 0., 0.")).distortion);
}

TEST_F(OpencvFiles, DistortionOfNoKnownKindIsNotDropped) {
    const std::string whole = kHead + kK + kR + kT;
    EXPECT_THAT(message(whole + "distortionParameters: [0.1, 0, 0, 0]\n"), HasSubstr("distortionParameters"));
    EXPECT_THAT(message(whole + "distortion_model: equidistant\nD: [0.1, 0, 0, 0]\n"),
                AllOf(HasSubstr("equidistant"), HasSubstr("fisheye")));
    EXPECT_THAT(message(whole + "fisheye_D: [0.1, 0, 0, 0]\n"), HasSubstr("fisheye"));
    EXPECT_THAT(message(whole + "D: [0.1, 0, 0]\n"), HasSubstr("number of D = 3"));
    EXPECT_THAT(message(whole + "D: [0.1, 0, 0, 0]\nk1: 0.1\n"), HasSubstr("one of them"));
    EXPECT_THAT(message(whole + "D: [0.1, 0, 0, 0]\ndist: [0.1, 0, 0, 0]\n"), HasSubstr("one of them"));
    EXPECT_NO_THROW((void)read(whole + "distortion_model: plumb_bob\nD: [0.1, 0, 0, 0, 0]\n"));
}

TEST_F(OpencvFiles, ImagesThatComeUndistortedAreLeftAlone) {
    const GeometryView view = read(kHead + kK + kR + kT + "D: [0.1, 0, 0, 0, 0]\n", {.undistorted = true});
    EXPECT_FALSE(view.distortion);
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("not undone again")));
}

TEST_F(OpencvFiles, AStereoPairIsTwoViewsOfCameraOnesWorld) {
    const std::string pair = kHead + yaml_matrix("M1", 3, 3, "3200., 0., 512., 0., 3200., 384., 0., 0., 1.") +
                             yaml_matrix("D1", 1, 5, "-0.21, 0.09, 0., 0., 0.") +
                             yaml_matrix("M2", 3, 3, "3100., 0., 500., 0., 3100., 380., 0., 0., 1.") +
                             yaml_matrix("D2", 1, 5, "-0.1, 0.09, 0., 0., 0.") + kR + kT;
    const std::vector<GeometryView> views = read_geometry(write("rig.yml", pair));
    ASSERT_EQ(views.size(), 2U);
    EXPECT_EQ(views[0].name, "rig_1");
    EXPECT_EQ(views[1].name, "rig_2");
    EXPECT_LT(source_world_mm(views[0].geometry).norm(), 1e-9);
    const Eigen::Vector3d x(7, -3, 700);
    EXPECT_LT((project(views[0].geometry, x) - Eigen::Vector2d(512 + 32, 384 - 3200 * 3.0 / 700)).norm(), 1e-9);
    // x_camera2 = R x + T.
    const Eigen::Vector3d second(-700 + 900, -3 + 10, 7 + 800);
    EXPECT_LT((project(views[1].geometry, x) -
               Eigen::Vector2d(500 + 3100 * second.x() / second.z(), 380 + 3100 * second.y() / second.z()))
                  .norm(),
              1e-9);
    EXPECT_EQ(views[0].distortion->k1, -0.21);
    EXPECT_EQ(views[1].distortion->k1, -0.1);
    EXPECT_EQ(read_geometry(at("rig.yml"), {.item = 2}).front().name, "rig_2");
    EXPECT_THAT(error_of([&] { (void)read_geometry(at("rig.yml"), {.item = 3}); }), HasSubstr("1 or 2"));
    EXPECT_THAT(message(replaced(pair, "T: ", "S: ")), HasSubstr("T or tvec"));
}

TEST_F(OpencvFiles, RosCameraInfoIsReadAsFarAsItHasAPose) {
    const std::string lists =
        "width: 1024\nheight: 768\ndistortion_model: plumb_bob\nD: [-0.2, 0.1, 0, 0, 0]\n"
        "K: [3200, 0, 500, 0, 3100, 380, 0, 0, 1]\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
        "P: [3200, 0, 500, 0, 0, 3100, 380, 0, 0, 0, 1, 0]\n";
    EXPECT_THAT(message(lists), HasSubstr("T or tvec"));
    const GeometryView view = read(lists + "T: [0, 0, 900]\n");
    EXPECT_EQ(view.geometry.camera.intrinsics_px(1, 2), 380);
    EXPECT_EQ(view.distortion->k1, -0.2);
    EXPECT_THAT(view.assumptions, Contains(AllOf(HasSubstr("P"), HasSubstr("not used"))));
    const GeometryView rows = read(kHead + "K: [[3200, 0, 500], [0, 3100, 380], [0, 0, 1]]\n" + kR + kT);
    EXPECT_EQ(rows.geometry.camera.intrinsics_px(0, 2), 500);
    EXPECT_THAT(message(kHead + "K: [[3200, 0, 500], [0, 3100]]\n" + kR + kT), HasSubstr("rows of equally many"));
}

TEST_F(OpencvFiles, AProjectionMatrixAloneIsAView) {
    const GeometryView view =
        read(kHead + yaml_matrix("P", 3, 4, "3200., 0., 500., 450000., 0., 3100., 380., 342000., 0., 0., 1., 900."));
    EXPECT_LT((project(view.geometry, {9, 0, 0}) - Eigen::Vector2d(532, 380)).norm(), 1e-9);
}

TEST_F(OpencvFiles, TransposedIntrinsicsAreRefusedWithTheReason) {
    const std::string matlab = yaml_matrix("camera_matrix", 3, 3, "3200., 0., 0., 0., 3100., 0., 501., 381., 1.");
    EXPECT_THAT(message(kHead + matlab + kR + kT),
                AllOf(HasSubstr("camera_matrix"), HasSubstr("transposed"), HasSubstr("MATLAB"), HasSubstr("501, 381")));
    const std::string view = R"({"name": "A", "size_px": [9, 7], "intrinsics": [[9, 0, 0], [0, 9, 0], [4, 3, 1]],
        "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,900],[0,0,0,1]]})";
    EXPECT_THAT(error_of([&] { (void)read_views(write("v.json", test::views_json(view)), ReadImages::never); }),
                HasSubstr("transposed"));
}

TEST_F(OpencvFiles, DistortionIsWrittenAndReadBack) {
    const GeometryView view = read(kHead + kK + kR + kT + "D: [-0.2, 0.1, 0.01, 0.02, 0.03]\n");
    const GeometryView again = read_geometry(write("b.yml", opencv_text(view.geometry, view.distortion))).front();
    ASSERT_TRUE(again.distortion);
    EXPECT_EQ(again.distortion->k3, 0.03);
    EXPECT_EQ(again.distortion->p1, 0.01);
    EXPECT_LT((projection_matrix(again.geometry) - projection_matrix(view.geometry)).norm(), 1e-9);
}

const std::string kMayaDistorted =
    "image size\n1024,1024\n\ncamera matrix\n3200,0,512\n0,3200,512\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\n"
    "translation\n0\n0\n900\n\nundistortion\n-0.21\n0.09\n0.001\n-0.002\n0\n0\n0\n0\n";

TEST_F(OpencvFiles, MayaCamsUndistortionMustBeSettledByTheUser) {
    const auto path = write("cam.txt", kMayaDistorted);
    EXPECT_THAT(error_of([&] { (void)read_geometry(path); }),
                AllOf(HasSubstr("undistortion"), HasSubstr("\"undistorted\""), HasSubstr("k1 -0.21")));
    EXPECT_EQ(read_geometry(path, {.undistorted = false}).front().distortion->p2, -0.002);
    const GeometryView exported = read_geometry(path, {.undistorted = true}).front();
    EXPECT_FALSE(exported.distortion);
    EXPECT_THAT(exported.assumptions, Contains(HasSubstr("not undone again")));
    const std::string none = replaced(kMayaDistorted, "-0.21\n0.09\n0.001\n-0.002", "0\n0\n0\n0");
    EXPECT_FALSE(read_geometry(write("none.txt", none)).front().distortion);
    const auto views =
        write("v.json", R"({"raylign": 1, "views": [{"name": "A", "geometry": "cam.txt", "undistorted": false}]})");
    EXPECT_TRUE(read_views(views, ReadImages::never).origins[0].distortion);
    const auto message_of = [&](const std::string& text) {
        return error_of([&] { (void)read_geometry(write("bad.txt", text), {.undistorted = false}); });
    };
    EXPECT_THAT(message_of(replaced(kMayaDistorted, "-0.21", "nan")), HasSubstr("number of undistortion = 0"));
    EXPECT_THAT(message_of(replaced(kMayaDistorted, "undistortion", "distortion")),
                HasSubstr("section = \"distortion\""));
    EXPECT_THAT(read_geometry(write("more.txt", none + "\nmarkers\n1,2\n")).front().assumptions,
                Contains(HasSubstr("\"markers\" in the file is not used")));
}

TEST_F(OpencvFiles, MayaCamsOfTheCommandLineAndOfATrialAreSettledByItsOption) {
    (void)write("cam.txt", kMayaDistorted);
    (void)write("trial.cfg", "Version 1.1\nmayaCam_csv cam.txt\nCameraRootDir .\nVolumeFile v.tif\nVoxelSize 1 1 1\n");
    for (const char* name : {"cam.txt", "trial.cfg"}) {
        const std::vector<std::string> arguments{at(name).string()};
        const auto read = [&](std::optional<bool> undistorted) {
            return read_views(arguments, {.images = ReadImages::never, .undistorted = undistorted}).origins.at(0);
        };
        EXPECT_THAT(error_of([&] { (void)read({}); }), HasSubstr("--undistorted")) << name;
        EXPECT_TRUE(read(false).distortion) << name;
        EXPECT_FALSE(read(true).distortion) << name;
    }
    const std::vector<std::string> json{
        write("v.json", R"({"raylign": 1, "views": [{"name": "A", "geometry": "cam.txt", "undistorted": true}]})")
            .string()};
    EXPECT_THAT(error_of([&] { (void)read_views(json, {.images = ReadImages::never, .undistorted = false}); }),
                AllOf(HasSubstr("v.json"), HasSubstr("says it itself")));
}

}  // namespace
}  // namespace raylign::detail
