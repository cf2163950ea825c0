#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "geometry_texts.h"
#include "io_files.h"
#include "raylign/io/geometry.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::kMayaCam2;
using test::kRtk;
using test::kRtkDistances;
using test::replaced;
using test::rtk;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class GeometryFormats : public test::IoTest {};

const GeometryHints kSize{.size_px = Eigen::Vector2i(120, 100)};

TEST_F(GeometryFormats, MayaCam2IsAnOpencvCamera) {
    const auto views = read_geometry(write("cam.txt", kMayaCam2));
    ASSERT_EQ(views.size(), 1U);
    EXPECT_EQ(views[0].name, "cam");
    EXPECT_EQ(views[0].flip, ImageFlip::none);
    EXPECT_EQ(views[0].geometry.camera.size_px, Eigen::Vector2i(120, 100));
    EXPECT_FALSE(views[0].geometry.camera.sdd_mm.has_value());
    // x_camera = (z + 5, -x - 7, -y + 900) of the world point (10, 20, 30).
    const Eigen::Vector2d pixel = project(views[0].geometry, {10, 20, 30});
    EXPECT_NEAR(pixel.x(), 61 + 2000 * 35.0 / 880, 1e-9);
    EXPECT_NEAR(pixel.y(), 48 - 2100 * 17.0 / 880, 1e-9);
    EXPECT_THAT(views[0].assumptions, Contains(HasSubstr("detector's distance")));
}

TEST_F(GeometryFormats, MayaCam2OfTheRealRigHasItsSourcesWhereTheyAreKnown) {
    const auto data = test::test_data() / "wrist";
    RAYLIGN_NEED_DATA(data / "xr_calib_wrist_cam01.txt");
    const auto first = read_geometry(data / "xr_calib_wrist_cam01.txt").front();
    const auto second = read_geometry(data / "xr_calib_wrist_cam02.txt").front();
    EXPECT_LT((source_world_mm(first.geometry) - Eigen::Vector3d(-530.00, 87.86, -728.16)).norm(), 0.02);
    EXPECT_LT((source_world_mm(second.geometry) - Eigen::Vector3d(1142.74, 74.04, -206.20)).norm(), 0.02);
}

TEST_F(GeometryFormats, MayaCam2SaysWhatIsMissingOrWrong) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_geometry(write("cam.txt", text)); });
    };
    EXPECT_THAT(message(replaced(kMayaCam2, "rotation", "rotate")), HasSubstr("\"rotation\" is missing"));
    EXPECT_THAT(message(kMayaCam2.substr(0, kMayaCam2.size() - 4)), HasSubstr("\"translation\" ends too soon"));
    EXPECT_THAT(message(replaced(kMayaCam2, "2100", "nan")), AllOf(HasSubstr("line 6"), HasSubstr("3 numbers")));
    EXPECT_THAT(message(replaced(kMayaCam2, "2100", "-2100")), HasSubstr("focal length fy"));
    EXPECT_THAT(message(replaced(kMayaCam2, "0,0,1\n-1", "0,0,2\n-1")), HasSubstr("orthonormal"));
    EXPECT_THAT(message(replaced(kMayaCam2, "120,100", "120.5,100")), HasSubstr("whole numbers"));
    EXPECT_THAT(
        error_of([&] { (void)read_geometry(write("c.txt", kMayaCam2), {.size_px = Eigen::Vector2i(100, 120)}); }),
        AllOf(HasSubstr("120 x 100"), HasSubstr("100 x 120")));
    EXPECT_THAT(
        error_of([&] { (void)read_geometry(write("c.txt", kMayaCam2), {.pixel_pitch_mm = Eigen::Vector2d(1, 1)}); }),
        HasSubstr("pixel_pitch_mm"));
}

TEST_F(GeometryFormats, AMirroredRotationIsRefusedAndTheFlipOffered) {
    const auto path = write("cam.txt", replaced(kMayaCam2, "0,0,1\n-1", "0,0,-1\n-1"));
    EXPECT_THAT(error_of([&] { (void)read_geometry(path); }),
                AllOf(HasSubstr("mirrored"), HasSubstr("\"flip\": \"columns\"")));
    const GeometryView view = read_geometry(path, {.flip = ImageFlip::columns}).front();
    // The stored pixel of the point, and the same in the turned image of 120 columns.
    const double stored = 61 + 2000 * (-30.0 + 5) / 880;
    EXPECT_NEAR(project(view.geometry, {10, 20, 30}).x(), 119 - stored, 1e-9);
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("columns are reversed")));
}

TEST_F(GeometryFormats, WindowsLineEndsAndBlanksChangeNothing) {
    std::string windows;
    for (const char c : kMayaCam2) windows += c == '\n' ? "  \r\n" : std::string(1, c);
    const auto view = read_geometry(write("cam.txt", windows)).front();
    EXPECT_NEAR(view.geometry.camera.intrinsics_px(1, 1), 2100, 1e-9);
}

/// The source at (0, 0, 100) cm looking down -z: columns along x, rows along -y.
TEST_F(GeometryFormats, MayaCam1LooksAlongMinusZWithCentimetresAndRowsFromTheBottom) {
    const auto path = write("cam.csv", "0,0,100\n0,0,0\n1,2,3\n512,300,-2000\n0.01,1000,800\n");
    const GeometryView view = read_geometry(path).front();
    EXPECT_LT((source_world_mm(view.geometry) - Eigen::Vector3d(0, 0, 1000)).norm(), 1e-9);
    // x = 20 mm right of the axis, y = 30 mm up, 1000 mm before the source.
    const Eigen::Vector2d pixel = project(view.geometry, {20, 30, 0});
    EXPECT_NEAR(pixel.x(), 511 + 2000 * 0.02, 1e-9);
    EXPECT_NEAR(pixel.y(), 799 - (299 + 2000 * 0.03), 1e-9);
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("lengths are cm")));
}

TEST_F(GeometryFormats, MayaCam1TurnsByItsOwnAxesZThenYThenX) {
    const auto path = write("cam.csv", "10,20,30\n15,-25,40\n0,0,0\n1,1,-1000\n1,100,100\n");
    const GeometryView view = read_geometry(path).front();
    const auto turn = [](int axis, double degrees) {
        Twist twist = Twist::Zero();
        twist[axis] = degrees * std::numbers::pi / 180;
        return exp(twist).rotation;
    };
    const Eigen::Matrix3d world_from_maya = turn(2, 40) * turn(1, -25) * turn(0, 15);
    EXPECT_LT((view.geometry.camera_from_world.rotation.row(0).transpose() - world_from_maya.col(0)).norm(), 1e-12);
    EXPECT_LT((view.geometry.camera_from_world.rotation.row(2).transpose() + world_from_maya.col(2)).norm(), 1e-12);
}

TEST_F(GeometryFormats, MayaCam1UnitsAreSaidAndOverruled) {
    const auto path = write("cam.csv", "0,0,1000\n0,0,0\n0,0,0\n512,512,-2000\n1,0,0\n");
    const GeometryView far = read_geometry(path).front();
    EXPECT_NEAR(source_world_mm(far.geometry).z(), 1000, 1e-9);
    EXPECT_THAT(far.assumptions, Contains(AllOf(HasSubstr("taken as mm"), HasSubstr("unit_mm"))));
    EXPECT_THAT(far.assumptions, Contains(HasSubstr("1024 x 1024")));
    EXPECT_NEAR(source_world_mm(read_geometry(path, {.unit_mm = 0.5}).front().geometry).z(), 500, 1e-9);
    EXPECT_THAT(error_of([&] { (void)read_geometry(write("p.csv", "0,0,9\n0,0,0\n0,0,0\n5,5,2000\n1,9,9\n")); }),
                HasSubstr("negative"));
}

/// As plastimatch 1.9.4 wrote it: drr -r "100 120" -z "300 420" -c "47.5 62.5" -y 30 --sad 1000 --sid 1500 -o "0 0 0".
const std::string kPlastimatch = R"(    4.75000000e+01     6.25000000e+01
   -3.29343875e-01     5.14171500e-02     0.00000000e+00     0.00000000e+00
    0.00000000e+00     0.00000000e+00    -2.85714286e-01     0.00000000e+00
   -1.02834300e-04    -6.58687749e-04     0.00000000e+00     6.66666667e-01
    1.00000000e+03
    1.50000000e+03
   -1.54251450e-01    -9.88031624e-01    -0.00000000e+00
Extrinsic
   -9.88031624e-01     1.54251450e-01    -0.00000000e+00     0.00000000e+00
    0.00000000e+00    -0.00000000e+00    -1.00000000e+00     0.00000000e+00
   -1.54251450e-01    -9.88031624e-01    -0.00000000e+00     1.00000000e+03
    0.00000000e+00     0.00000000e+00     0.00000000e+00     1.00000000e+00
Intrinsic
    3.33333333e-01     0.00000000e+00     0.00000000e+00     0.00000000e+00
    0.00000000e+00     2.85714286e-01     0.00000000e+00     0.00000000e+00
    0.00000000e+00     0.00000000e+00     6.66666667e-04     0.00000000e+00
)";

TEST_F(GeometryFormats, PlastimatchFileOfItsOwnProgramIsUnderstood) {
    const GeometryView view =
        read_geometry(write("drr.txt", kPlastimatch), {.size_px = Eigen::Vector2i(100, 120)}).front();
    const Camera& camera = view.geometry.camera;
    EXPECT_NEAR(*camera.sdd_mm, 1500, 1e-9);
    EXPECT_NEAR(camera.pixel_pitch_mm()->x(), 3, 1e-6);
    EXPECT_NEAR(camera.pixel_pitch_mm()->y(), 3.5, 1e-6);
    EXPECT_LT((source_world_mm(view.geometry) - 1000 * Eigen::Vector3d(0.154251450, 0.988031624, 0)).norm(), 1e-5);
    EXPECT_LT((project(view.geometry, {0, 0, 0}) - Eigen::Vector2d(47.5, 62.5)).norm(), 1e-6);
    EXPECT_LT(project(view.geometry, {0, 0, 10}).y(), 62);  // the head is on top
}

TEST_F(GeometryFormats, PlastimatchContradictionsAreErrors) {
    const auto message = [&](const std::string& text) {
        return error_of([&] { (void)read_geometry(write("drr.txt", text), kSize); });
    };
    EXPECT_THAT(message(replaced(kPlastimatch, "1.50000000e+03", "1.40000000e+03")),
                AllOf(HasSubstr("1400"), HasSubstr("contradicts"), HasSubstr("1500")));
    EXPECT_THAT(message(replaced(kPlastimatch, "-3.29343875e-01", "-3.39343875e-01")), HasSubstr("contradicts"));
    EXPECT_THAT(message(kPlastimatch.substr(0, kPlastimatch.find("Intrinsic"))), HasSubstr("\"Intrinsic\" is missing"));
    EXPECT_THAT(error_of([&] { (void)read_geometry(write("drr.txt", kPlastimatch)); }), HasSubstr("size_px"));
}

/// RTK's own statement of gantry 0: source at (0, 0, 1000), detector's u along x, v along y.
TEST_F(GeometryFormats, RtkAtGantryZeroLooksAlongMinusZ) {
    const auto path = write("g.xml", rtk(kRtkDistances + "<GantryAngle>0</GantryAngle>"
                                                         "<ProjectionOffsetX>4</ProjectionOffsetX>"));
    const GeometryView view = read_geometry(path, kRtk).front();
    EXPECT_LT((source_world_mm(view.geometry) - Eigen::Vector3d(0, 0, 1000)).norm(), 1e-9);
    const Eigen::Vector2d detector_mm = 1536.0 / 990 * Eigen::Vector2d(20, 30) - Eigen::Vector2d(4, 0);
    const Eigen::Vector2d stored = detector_mm.cwiseQuotient(Eigen::Vector2d(2, 3)) + Eigen::Vector2d(59.5, 49.5);
    const Eigen::Vector2d pixel = project(view.geometry, {20, 30, 10});
    EXPECT_NEAR(pixel.x(), stored.x(), 1e-9);
    EXPECT_NEAR(pixel.y(), 99 - stored.y(), 1e-9);
    EXPECT_EQ(view.flip, ImageFlip::rows);
}

/// [rtkThreeDCircularProjectionGeometry: GetSourcePosition] at gantry 90 the source is at R^-1 (0, 0, sid) with
/// R = Ry(-90).
TEST_F(GeometryFormats, RtkGantryTurnsTheSourceTowardsPlusX) {
    const auto path = write("g.xml", rtk(kRtkDistances + "<GantryAngle>90</GantryAngle>"));
    EXPECT_LT((source_world_mm(read_geometry(path, kRtk).front().geometry) - Eigen::Vector3d(1000, 0, 0)).norm(), 1e-9);
}

TEST_F(GeometryFormats, RtkProjectionsAreNumberedAndShareWhatIsCommon) {
    const std::string text = replaced(rtk("<GantryAngle>10</GantryAngle>", kRtkDistances), "</RTKThree",
                                      "<Projection><GantryAngle>20</GantryAngle></Projection></RTKThree");
    const auto path = write("g.xml", text);
    const auto views = read_geometry(path, kRtk);
    ASSERT_EQ(views.size(), 2U);
    EXPECT_EQ(views[1].name, "g_2");
    GeometryHints second = kRtk;
    second.item = 2;
    EXPECT_EQ(read_geometry(path, second).size(), 1U);
    second.item = 3;
    EXPECT_THAT(error_of([&] { (void)read_geometry(path, second); }), HasSubstr("in [1, 2]"));
}

TEST_F(GeometryFormats, RtkFaultsAreNamed) {
    const auto message = [&](const std::string& text, const GeometryHints& hints = kRtk) {
        return error_of([&] { (void)read_geometry(write("g.xml", text), hints); });
    };
    EXPECT_THAT(message(rtk("<GantryAngle>0</GantryAngle>")), HasSubstr("SourceToIsocenterDistance is missing"));
    EXPECT_THAT(message(rtk(kRtkDistances)), HasSubstr("GantryAngle is missing"));
    EXPECT_THAT(message(rtk(kRtkDistances + "<GantryAngle>ten</GantryAngle>")), HasSubstr("GantryAngle = \"ten\""));
    EXPECT_THAT(message(rtk(kRtkDistances + "<GantryAngle>0</GantryAngle><Matrix>1 0 0 0 0 1 0 0 0 0 1 0</Matrix>")),
                HasSubstr("contradicts"));
    EXPECT_THAT(message(rtk(kRtkDistances).substr(0, 120)), HasSubstr("not valid XML"));
    EXPECT_THAT(message("<html></html>"), HasSubstr("RTKThreeDCircularGeometry"));
    EXPECT_THAT(message(replaced(rtk(""), "version=\"3\"", "version=\"1\"")), HasSubstr("version"));
    const std::string good = rtk(kRtkDistances + "<GantryAngle>0</GantryAngle>");
    EXPECT_THAT(message(good, {.size_px = Eigen::Vector2i(8, 8)}), HasSubstr("pixel_pitch_mm"));
    EXPECT_THAT(message(replaced(good, "1536", "0")), HasSubstr("parallel"));
}

}  // namespace
}  // namespace raylign::detail
