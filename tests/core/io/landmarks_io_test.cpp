#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::HasSubstr;

class Landmarks : public test::IoTest {};

std::string markups(const std::string& system, const std::string& more = "") {
    return R"({"@schema": "x", "markups": [{"type": "Fiducial", "coordinateSystem": ")" + system +
           R"(", "coordinateUnits": "mm", "controlPoints": [
  {"id": "1", "label": "tip", "position": [1, 2, 3], "positionStatus": "defined"},
  {"id": "2", "label": "base", "position": [-4, 5, 6]})" +
           more + "]}]}";
}

TEST_F(Landmarks, MarkupsAreBroughtToLps) {
    const auto lps = read_landmarks(write("a.mrk.json", markups("LPS")));
    ASSERT_EQ(lps.size(), 2U);
    EXPECT_EQ(lps[0].name, "tip");
    EXPECT_EQ(lps[0].x_ct_mm, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(read_landmarks(write("b.json", markups("RAS")))[1].x_ct_mm, Eigen::Vector3d(4, -5, 6));
    const std::string open = R"(,{"id": "3", "label": "later", "position": [0, 0, 0], "positionStatus": "undefined"})";
    EXPECT_EQ(read_landmarks(write("c.json", markups("LPS", open))).size(), 2U);
}

TEST_F(Landmarks, FcsvHasItsLabelsAndItsAxes) {
    const std::string rows =
        "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
        "vtk_0,1,2,3,0,0,0,1,1,1,0,tip,,\nvtk_1,4,5,6,0,0,0,1,1,1,0,base,,\n";
    const auto ras =
        read_landmarks(write("a.fcsv", "# Markups fiducial file version = 4.6\n# CoordinateSystem = 0\n" + rows));
    EXPECT_EQ(ras[0].name, "tip");
    EXPECT_EQ(ras[0].x_ct_mm, Eigen::Vector3d(-1, -2, 3));
    EXPECT_EQ(read_landmarks(write("b.fcsv", "# CoordinateSystem = LPS\n" + rows))[1].x_ct_mm,
              Eigen::Vector3d(4, 5, 6));
}

TEST_F(Landmarks, CsvWithAndWithoutNames) {
    EXPECT_EQ(read_landmarks(write("a.csv", "name,x,y,z\ntip,1,2,3\n"))[0].name, "tip");
    EXPECT_EQ(read_landmarks(write("b.csv", "1,2,3\n4,5,6\n")).size(), 2U);
    const auto points = read_image_points(write("c.csv", "# marked on cam01\ntip, 10.5, 20\nbase,30,40\n"));
    EXPECT_EQ(points[0].pixel, Eigen::Vector2d(10.5, 20));
    EXPECT_EQ(points[1].name, "base");
    EXPECT_EQ(read_image_points(write("d.json", R"({"points_px": {"tip": [1, 2]}})"))[0].name, "tip");
    EXPECT_EQ(read_image_points(write("e.json", R"({"points_px": [[1, 2], [3, 4]]})"))[1].pixel, Eigen::Vector2d(3, 4));
}

TEST_F(Landmarks, TargetsMayBeMarkups) {
    EXPECT_EQ(read_targets(write("t.json", markups("RAS")))[0], Eigen::Vector3d(-1, -2, 3));
}

TEST_F(Landmarks, FaultsAreNamed) {
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.json", markups("IJK"))); }),
                HasSubstr("CoordinateSystem"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.json", "{}")); }), HasSubstr("markups is missing"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.csv", "tip,1,2\n")); }), HasSubstr("line 1"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.csv", "tip,1,2,nan\n")); }), HasSubstr("finite"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.csv", "a,1,2,3\na,4,5,6\n")); }), HasSubstr("twice"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.csv", "a,1,2,3\n4,5,6\n")); }), HasSubstr("all or none"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.csv", "# none\n")); }), HasSubstr("no points"));
    EXPECT_THAT(error_of([&] { (void)read_landmarks(write("a.xyz", "1 2 3\n")); }), HasSubstr(".fcsv"));
    EXPECT_THAT(error_of([&] { (void)read_image_points(write("a.csv", "x,y\n1;2\n")); }), HasSubstr("name,x,y"));
}

}  // namespace
}  // namespace raylign::detail
