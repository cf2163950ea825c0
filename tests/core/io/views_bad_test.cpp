#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/views.h"
#include "views_text.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::kCameraView;
using test::replaced;
using test::views_json;
using testing::AllOf;
using testing::HasSubstr;

class BadViews : public test::IoTest {
protected:
    std::string error_text(const std::string& json, ReadImages images = ReadImages::never) {
        const std::string message = error_of([&] { (void)read_views(write("views.json", json), images); });
        EXPECT_THAT(message, HasSubstr("views.json"));
        return message;
    }
    /// The error of kCameraView with `from` replaced by `to`.
    std::string error_with(const std::string& from, const std::string& to, ReadImages images = ReadImages::never) {
        return error_text(views_json(replaced(kCameraView, from, to)), images);
    }
};

TEST_F(BadViews, MalformedJsonNamesLineAndColumn) {
    EXPECT_THAT(error_text("{ \"raylign\": 1,\n  \"views\": [ }"), AllOf(HasSubstr("line 2"), HasSubstr("column 14")));
    EXPECT_THAT(error_text("{ \"raylign\": 1"), HasSubstr("line 1"));
}
TEST_F(BadViews, DeeplyNestedJsonIsRefused) {
    const std::string open(200000, '['), close(200000, ']');
    EXPECT_THAT(error_text(open), HasSubstr("nested deeper than 64 levels"));
    EXPECT_THAT(error_text("{\"raylign\":\n" + open + close + "}"),
                AllOf(HasSubstr("nested deeper than 64 levels"), HasSubstr("line 2, column 6")));
}
TEST_F(BadViews, NumberTooLargeNamesLineAndColumn) {
    EXPECT_THAT(error_text("{ \"raylign\": 1,\n  \"views\": 1e999\n}"),
                AllOf(HasSubstr("1e999"), HasSubstr("line 2, column 16")));
}
TEST_F(BadViews, MaskOfZerosIsNamed) {
    write_image(at("good.tif"), Image(8, 6, 1));
    write_image(at("none.tif"), Image(8, 6, 0));
    const std::string view = replaced(kCameraView, R"("AP",)", R"("AP", "image": "good.tif", "mask": "none.tif",)");
    EXPECT_THAT(error_of([&] { (void)read_views(write("views.json", views_json(view)), ReadImages::required); }),
                AllOf(HasSubstr("mask"), HasSubstr("none.tif is 0 everywhere")));
}
TEST_F(BadViews, MissingAndEmptyFilesAreNamed) {
    EXPECT_THAT(error_of([&] { (void)read_views(at("none.json"), ReadImages::never); }), HasSubstr("does not exist"));
    EXPECT_THAT(error_text(""), HasSubstr("empty"));
}
TEST_F(BadViews, VersionMustBeOne) {
    EXPECT_THAT(error_text(R"({"raylign": 2, "views": []})"), AllOf(HasSubstr("raylign = 2"), HasSubstr("must be 1")));
    EXPECT_THAT(error_text(R"({"views": []})"), HasSubstr("raylign is missing"));
    EXPECT_THAT(error_text(R"([1])"), HasSubstr("an object"));
}
TEST_F(BadViews, NoViewsAreTooFew) { EXPECT_THAT(error_text(views_json("")), HasSubstr("at least one view")); }
TEST_F(BadViews, UnknownKeysNameThePathAndTheNearestKey) {
    EXPECT_THAT(error_with("sdd_mm", "sdd"),
                AllOf(HasSubstr("views[0].camera.sdd "), HasSubstr("did you mean \"sdd_mm\"")));
    EXPECT_THAT(error_with("\"name\"", "\"nmae\""),
                AllOf(HasSubstr("views[0].nmae"), HasSubstr("did you mean \"name\"")));
    EXPECT_THAT(error_text(R"({"raylign": 1, "view": []})"), HasSubstr("did you mean \"views\""));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "intensity": {"I_0": 3},)"), HasSubstr("views[0].intensity.I_0"));
}
TEST_F(BadViews, KeyGivenTwiceIsRefused) {
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "name": "LAT",)"), HasSubstr("\"name\" is given twice"));
}
TEST_F(BadViews, WrongTypesAndLengthsNameThePathAndValue) {
    EXPECT_THAT(error_with("1500", "\"far\""), HasSubstr("views[0].camera.sdd_mm = \"far\""));
    EXPECT_THAT(error_with("[2, 3]", "[2]"),
                AllOf(HasSubstr("views[0].camera.pixel_pitch_mm = [2]"), HasSubstr("2 numbers")));
    EXPECT_THAT(error_with("[2, 3]", "2"), HasSubstr("pixel_pitch_mm = 2"));
    EXPECT_THAT(error_with("[8, 6]", "[8.5, 6]"), HasSubstr("size_px = [8.5,6]"));
    EXPECT_THAT(error_with("[8, 6]", "[0, 6]"), HasSubstr("size_px = [0,6]"));
    EXPECT_THAT(error_with("[0,0,1,1000],", ""), HasSubstr("4 rows of 4 numbers"));
    EXPECT_THAT(error_with("\"AP\"", "7"), HasSubstr("views[0].name = 7"));
    EXPECT_THAT(error_with("1500", "1e999"), HasSubstr("1e999"));
}
TEST_F(BadViews, BadNumbersNameThePathAndValue) {
    EXPECT_THAT(error_with("1500", "-1500"), AllOf(HasSubstr("sdd_mm = -1500"), HasSubstr("positive")));
    EXPECT_THAT(error_with("[2, 3]", "[0, 3]"), HasSubstr("two positive numbers"));
    EXPECT_THAT(error_with("[[1,0,0,0]", "[[1,0.1,0,0]"),
                AllOf(HasSubstr("views[0].camera_from_world"), HasSubstr("orthonormal")));
    EXPECT_THAT(error_with("[[1,0,0,0]", "[[-1,0,0,0]"), HasSubstr("mirrors"));
    EXPECT_THAT(error_with("[0,0,0,1]]", "[0,0,0,2]]"), HasSubstr("0 0 0 1"));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "intensity": {"i0": 0},)"), HasSubstr("i0 = 0"));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "intensity": {"kind": "raw"},)"),
                AllOf(HasSubstr("kind = \"raw\""), HasSubstr("auto, line-integral, transmission")));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "intensity": {"polarity": "dark"},)"),
                HasSubstr("bone-bright, bone-dark"));
}
TEST_F(BadViews, CArmNumbersAreChecked) {
    const std::string c_arm = R"({"name": "C", "c_arm": {"sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 30,
        "secondary_angle_deg": -10, "pixel_pitch_mm": [2, 3], "size_px": [8, 6]}})";
    EXPECT_THAT(error_text(views_json(replaced(c_arm, "1500", "900"))), HasSubstr("sdd_mm = 900"));
    EXPECT_THAT(error_text(views_json(replaced(c_arm, "-10", "-1000"))), HasSubstr("[-360, 360]"));
    EXPECT_THAT(error_text(views_json(replaced(c_arm, "\"sad_mm\": 1000,", ""))),
                HasSubstr("views[0].c_arm.sad_mm is missing"));
}
TEST_F(BadViews, TwoFormsOfGeometryContradict) {
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "projection_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]],)"),
                AllOf(HasSubstr("twice"), HasSubstr("camera"), HasSubstr("projection_matrix")));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "size_px": [8, 6],)"), HasSubstr("views[0].size_px"));
    EXPECT_THAT(
        error_text(views_json(R"({"name": "P", "size_px": [8, 6], "projection_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]],
        "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,1000],[0,0,0,1]]})")),
        HasSubstr("contradicts"));
}
TEST_F(BadViews, MissingGeometryIsNamed) {
    EXPECT_THAT(error_text(views_json(R"({"name": "A"})")), AllOf(HasSubstr("views[0]"), HasSubstr("no geometry")));
    EXPECT_THAT(
        error_text(views_json(R"({"name": "K", "intrinsics": [[750,0,3],[0,500,2.5],[0,0,1]], "size_px": [8, 6]})")),
        HasSubstr("views[0].camera_from_world is missing"));
    EXPECT_THAT(
        error_text(views_json(R"({"name": "P", "projection_matrix": [[750,0,3,3000],[0,500,2.5,2500],[0,0,1,1000]]})")),
        HasSubstr("views[0].size_px is missing"));
}
TEST_F(BadViews, SingularMatricesAreRefused) {
    EXPECT_THAT(error_text(views_json(
                    R"({"name": "P", "size_px": [8, 6], "projection_matrix": [[1,0,0,0],[1,0,0,0],[0,0,1,0]]})")),
                HasSubstr("projection_matrix"));
    EXPECT_THAT(
        error_text(views_json(R"({"name": "K", "size_px": [8, 6], "intrinsics": [[750,0,3],[0,-500,2.5],[0,0,1]],
        "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,1000],[0,0,0,1]]})")),
        HasSubstr("fy"));
}
TEST_F(BadViews, NamesMustDifferAndFitFileNames) {
    EXPECT_THAT(error_text(views_json(kCameraView + "," + replaced(kCameraView, "AP", "ap"))),
                HasSubstr("views[1].name = \"ap\""));
    for (const std::string name : {"a/b", "", "..", "a b", ".hidden"}) {
        EXPECT_THAT(error_with("\"AP\"", "\"" + name + "\""), HasSubstr("views[0].name = \"" + name + "\""));
    }
}
TEST_F(BadViews, ImageAndMaskMustHaveTheCamerasSize) {
    write_image(at("a.tif"), Image(9, 6, 1));
    write_image(at("good.tif"), Image(8, 6, 1));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "image": "a.tif",)", ReadImages::required),
                AllOf(HasSubstr("a.tif = 9 x 6"), HasSubstr("8 x 6"), HasSubstr("views[0]")));
    EXPECT_THAT(error_with(R"("AP",)", R"("AP", "image": "good.tif", "mask": "a.tif",)", ReadImages::required),
                AllOf(HasSubstr("mask"), HasSubstr("9 x 6"), HasSubstr("8 x 6")));
}
TEST_F(BadViews, MissingFilesAreNamed) {
    const std::string view = replaced(kCameraView, R"("AP",)", R"("AP", "image": "none.tif",)");
    EXPECT_THAT(error_of([&] { (void)read_views(write("views.json", views_json(view)), ReadImages::if_named); }),
                AllOf(HasSubstr("none.tif"), HasSubstr("does not exist")));
    EXPECT_THAT(error_text(views_json(kCameraView), ReadImages::required), HasSubstr("views[0].image is missing"));
}

}  // namespace
}  // namespace raylign::detail
