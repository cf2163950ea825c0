#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

#include "dicom_files.h"
#include "io_files.h"
#include "raylign/io/geometry.h"
#include "raylign/io/image.h"
#include "raylign/io/views.h"
#include "tests/support/letter_phantom.h"
#include "xa_files.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::XaFile;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint32_t kSdd = 0x00181110, kSpd = 0x00181111, kMagnification = 0x00181114, kPitch = 0x00181164,
                        kPrimary = 0x00181510, kSecondary = 0x00181511, kOrientation = 0x00200020,
                        kRotation = 0x00187032, kFlip = 0x00187034;

class DicomGeometry : public test::IoTest {
protected:
    [[nodiscard]] GeometryView view_of(const XaFile& file, const GeometryHints& hints = {}) const {
        return read_geometry(write("xa.dcm", file.bytes()), hints).front();
    }
    [[nodiscard]] std::string message_of(const XaFile& file, const GeometryHints& hints = {}) const {
        return error_of([&] { (void)view_of(file, hints); });
    }
};

/// Where the stored image of the default file shows a point: told without any camera. The observer stands at the
/// detector and faces the patient; at 0/0 the patient's left is on the right side and the head on top.
Eigen::Vector2d stored_pixel(const Eigen::Vector3d& x_lps, double primary_deg = 30, double secondary_deg = -20) {
    const double p = primary_deg * std::numbers::pi / 180, s = secondary_deg * std::numbers::pi / 180;
    // From the isocentre to the detector: anterior, turned to the left (LAO) and to the head (CRA).
    const Eigen::Vector3d to_detector(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s));
    const Eigen::Vector3d right(std::cos(p), std::sin(p), 0);
    const Eigen::Vector3d up = Eigen::Vector3d(0, 0, 1) - std::sin(s) * to_detector;
    const double magnification = 1200 / (800 + to_detector.dot(x_lps));
    return {19.5 + right.dot(x_lps) * magnification / 0.4, 14.5 - up.normalized().dot(x_lps) * magnification / 0.5};
}

/// The camera's pixel of the image as it was stored.
Eigen::Vector2d stored_by(const GeometryView& view, const Eigen::Vector3d& x_lps) {
    Eigen::Vector2d pixel = project(view.geometry, x_lps);
    const Eigen::Vector2i size = view.geometry.camera.size_px;
    if (view.flip == ImageFlip::columns) pixel.x() = size.x() - 1 - pixel.x();
    if (view.flip == ImageFlip::rows) pixel.y() = size.y() - 1 - pixel.y();
    return pixel;
}

TEST_F(DicomGeometry, AnglesDistancesAndSpacingPlaceEveryPoint) {
    const GeometryView view = view_of({});
    EXPECT_TRUE(view.is_dicom);
    EXPECT_EQ(view.flip, ImageFlip::columns);
    EXPECT_NEAR(*view.geometry.camera.sdd_mm, 1200, 1e-9);
    for (const Eigen::Vector3d& x : {Eigen::Vector3d(0, 0, 0), {3, 0, 0}, {0, 4, 0}, {0, 0, 5}, {-2, 3, 4}}) {
        EXPECT_LT((stored_by(view, x) - stored_pixel(x)).norm(), 1e-9) << x.transpose();
    }
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("observer at the detector")));
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("isocentre")));
}

TEST_F(DicomGeometry, MissingTagsAreNamed) {
    const std::vector<std::pair<std::uint32_t, const char*>> needed = {
        {kSdd, "DistanceSourceToDetector (0018,1110)"},
        {kSpd, "DistanceSourceToPatient (0018,1111)"},
        {kPitch, "ImagerPixelSpacing (0018,1164)"},
        {kPrimary, "PositionerPrimaryAngle (0018,1510)"},
        {kSecondary, "PositionerSecondaryAngle (0018,1511)"}};
    for (const auto& [tag, name] : needed) {
        EXPECT_THAT(message_of(XaFile().erase(tag)),
                    AllOf(HasSubstr(name), HasSubstr("is missing"), HasSubstr("xa.dcm")));
        EXPECT_THAT(message_of(XaFile().set(tag, "DS", "")), HasSubstr(name));
    }
}

TEST_F(DicomGeometry, HintsStandInForMissingTags) {
    const XaFile bare = XaFile().erase(kSdd).erase(kSpd).erase(kPitch).erase(kPrimary).erase(kSecondary);
    const GeometryView view = view_of(bare, {.pixel_pitch_mm = Eigen::Vector2d(0.4, 0.5),
                                             .sdd_mm = 1200,
                                             .sad_mm = 800,
                                             .primary_angle_deg = 30,
                                             .secondary_angle_deg = -20});
    EXPECT_LT((projection_matrix(view.geometry) - projection_matrix(view_of({}).geometry)).norm(), 1e-9);
}

TEST_F(DicomGeometry, MagnificationGivesTheIsocentreOrMustAgree) {
    const GeometryView view = view_of(XaFile().erase(kSpd).set(kMagnification, "DS", "1.5"));
    EXPECT_LT((projection_matrix(view.geometry) - projection_matrix(view_of({}).geometry)).norm(), 1e-9);
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("follows from EstimatedRadiographicMagnificationFactor")));
    EXPECT_THAT(message_of(XaFile().set(kMagnification, "DS", "1.7")),
                AllOf(HasSubstr("contradicts"), HasSubstr("1.5")));
}

TEST_F(DicomGeometry, ContradictionsAreErrors) {
    EXPECT_THAT(message_of(XaFile().set(kSdd, "DS", "700")), AllOf(HasSubstr("700"), HasSubstr("contradicts")));
    EXPECT_THAT(message_of(XaFile().set(kSdd, "DS", "-5")), HasSubstr("positive"));
    EXPECT_THAT(message_of(XaFile().set(kSdd, "DS", "abc")), HasSubstr("finite number"));
    EXPECT_THAT(message_of(XaFile().set(kPrimary, "DS", "200")), HasSubstr("in [-180, 180]"));
    EXPECT_THAT(message_of(XaFile().set(kSecondary, "DS", "-91")), HasSubstr("in [-90, 90]"));
    EXPECT_THAT(message_of(XaFile().set(kPitch, "DS", "0.5\\0")), HasSubstr("positive"));
    EXPECT_THAT(message_of(XaFile().set(kRotation, "DS", "45")), HasSubstr("0, 90, 180 or 270"));
    EXPECT_THAT(message_of(XaFile().set(kFlip, "CS", "MAYBE")), HasSubstr("YES or NO"));
    EXPECT_THAT(message_of(XaFile().set(kOrientation, "CS", "X\\F")), HasSubstr("PatientOrientation"));
    EXPECT_THAT(message_of(XaFile().set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.4")), HasSubstr("= MR"));
    EXPECT_THAT(message_of({}, {.size_px = Eigen::Vector2i(30, 40)}), HasSubstr("40 x 30"));
}

/// How the stored image of `file` would look for the observer at the detector, pixel by pixel.
TEST_F(DicomGeometry, FieldRotationIsClockwiseAndComesBeforeTheFlip) {
    const Eigen::Vector3d x(3, -2, 4);
    const Eigen::Vector2d plain = stored_pixel(x) - Eigen::Vector2d(19.5, 14.5);  // right, down [px of 0.4, 0.5 mm]
    const Eigen::Vector2d mm = plain.cwiseProduct(Eigen::Vector2d(0.4, 0.5));
    // Clockwise by 90: right becomes down, up becomes right.
    const Eigen::Vector2d turned_mm(-mm.y(), mm.x());
    const auto expected = [](const Eigen::Vector2d& at_mm) {
        return Eigen::Vector2d(19.5 + at_mm.x() / 0.4, 14.5 + at_mm.y() / 0.5);
    };
    const XaFile turned = XaFile().set(kRotation, "DS", "90").set(kFlip, "CS", "NO");
    EXPECT_LT((stored_by(view_of(turned), x) - expected(turned_mm)).norm(), 1e-9);
    const XaFile flipped = XaFile().set(kRotation, "DS", "90").set(kFlip, "CS", "YES");
    EXPECT_LT((stored_by(view_of(flipped), x) - expected({-turned_mm.x(), turned_mm.y()})).norm(), 1e-9);
    EXPECT_EQ(view_of(flipped).flip, ImageFlip::none);  // the flip shows it as the source sees it
    EXPECT_EQ(view_of(turned).flip, ImageFlip::columns);
}

TEST_F(DicomGeometry, PatientOrientationDecidesWhereNoFieldTagsDo) {
    const Eigen::Vector3d x(3, -2, 4);
    const GeometryView as_usual = view_of(XaFile().set(kOrientation, "CS", "LP\\F"));
    EXPECT_LT((stored_by(as_usual, x) - stored_pixel(x)).norm(), 1e-9);
    EXPECT_THAT(as_usual.assumptions, Contains(HasSubstr("columns and rows by PatientOrientation")));
    const GeometryView from_source = view_of(XaFile().set(kOrientation, "CS", "R\\F"));
    EXPECT_EQ(from_source.flip, ImageFlip::none);
    EXPECT_NEAR(stored_by(from_source, x).x(), 39 - stored_pixel(x).x(), 1e-9);
    const GeometryView upside_down = view_of(XaFile().set(kOrientation, "CS", "L\\H"));
    EXPECT_NEAR(stored_by(upside_down, x).y(), 29 - stored_pixel(x).y(), 1e-9);
    EXPECT_THAT(message_of(XaFile().set(kOrientation, "CS", "A\\L")), HasSubstr("contradicts the positioner's angles"));
}

TEST_F(DicomGeometry, AMirrorBetweenOrientationAndTagsIsOfferedNotMended) {
    const XaFile file = XaFile().set(kOrientation, "CS", "R\\F").set(kRotation, "DS", "0").set(kFlip, "CS", "NO");
    EXPECT_THAT(message_of(file),
                AllOf(HasSubstr("mirrored"), HasSubstr("\"flip\": \"none\" to follow the orientation"),
                      HasSubstr("\"flip\": \"columns\" to follow the tags")));
    const Eigen::Vector3d x(3, -2, 4);
    EXPECT_LT((stored_by(view_of(file, {.flip = ImageFlip::columns}), x) - stored_pixel(x)).norm(), 1e-9);
    EXPECT_NEAR(stored_by(view_of(file, {.flip = ImageFlip::none}), x).x(), 39 - stored_pixel(x).x(), 1e-9);
    EXPECT_THAT(message_of(XaFile(file).set(kOrientation, "CS", "H\\L")), HasSubstr("the image is turned"));
    EXPECT_NO_THROW((void)view_of(XaFile(file).set(kOrientation, "CS", "L\\F")));
}

/// A field of 40 x 30 px of 0.4 x 0.5 mm, cut out of a detector of 0.2 x 0.25 mm elements: the active area of 60 x 50
/// mm begins at element (row 10, column 20), the field at (50, 80).
TEST_F(DicomGeometry, FieldOriginMovesThePrincipalPoint) {
    XaFile file;
    file.set(0x00187028, "DS", "10\\20").set(0x00187026, "DS", "50\\60").set(0x00187022, "DS", "0.25\\0.2");
    file.set(0x00187030, "DS", "50\\80").set(kRotation, "DS", "0").set(kFlip, "CS", "NO");
    // Middle of the active area from the field's first corner: columns (20 - 80) 0.2 + 30 = 18 mm, rows -10 + 25 = 15.
    const Eigen::Vector2d middle(18 / 0.4 - 0.5, 15 / 0.5 - 0.5);
    EXPECT_LT((stored_by(view_of(file), {0, 0, 0}) - middle).norm(), 1e-9);
    // Turned clockwise by 180 the corner that was last is first.
    file.set(kRotation, "DS", "180");
    EXPECT_LT((stored_by(view_of(file), {0, 0, 0}) - Eigen::Vector2d(39 - middle.x(), 29 - middle.y())).norm(), 1e-9);
    file.erase(0x00187022);
    EXPECT_THAT(view_of(file).assumptions, Contains(AllOf(HasSubstr("FieldOfViewOrigin"), HasSubstr("not used"))));
}

TEST_F(DicomGeometry, FramesHaveTheirAnglesAndPixels) {
    XaFile file;
    file.frames = 3;
    file.set(0x00181520, "DS", "0\\5\\10").set(0x00181521, "DS", "0\\1\\2");
    for (int f = 0; f < 3; ++f) file.pixels.insert(file.pixels.end(), 1200, static_cast<std::uint16_t>(100 * (f + 1)));
    const GeometryView second = view_of(file, {.item = 2});
    EXPECT_LT((stored_by(second, {3, -2, 4}) - stored_pixel({3, -2, 4}, 35, -19)).norm(), 1e-9);
    EXPECT_THAT(second.assumptions, Contains(HasSubstr("frame 2 of 3")));
    EXPECT_THAT(message_of(file, {.item = 4}), HasSubstr("in [1, 3]"));
    EXPECT_EQ(xray_frame_count(at("xa.dcm")), 3);
    EXPECT_EQ(read_xray(at("xa.dcm"), 3).image(5, 5), 300);
    EXPECT_EQ(XrayFile(at("xa.dcm")).frame(2).image(0, 29), 200);
    EXPECT_THAT(error_of([&] { (void)read_xray(at("xa.dcm")); }), AllOf(HasSubstr("frame"), HasSubstr("3 frames")));
    EXPECT_THAT(error_of([&] { (void)read_xray(at("xa.dcm"), 4); }), HasSubstr("in [1, 3]"));
    EXPECT_THAT(message_of(file.set(0x00181520, "DS", "0\\5")), HasSubstr("as many as frames"));
}

TEST_F(DicomGeometry, DxViewPositionStandsInForAngles) {
    const XaFile dx =
        XaFile().erase(kPrimary).erase(kSecondary).set(0x00185101, "CS", "AP").set(kOrientation, "CS", "L\\F");
    const GeometryView view = view_of(dx);
    EXPECT_LT((source_world_mm(view.geometry) - Eigen::Vector3d(0, -800, 0)).norm(), 1e-9);
    EXPECT_EQ(view.flip, ImageFlip::none);  // from the front, as the source sees it
    EXPECT_THAT(view.assumptions, Contains(HasSubstr("ViewPosition")));
}

TEST_F(DicomGeometry, EnhancedXaHasTheGeometryOfEachFrame) {
    const auto group = [](std::uint32_t macro, const test::DicomBuilder& values) {
        return test::DicomBuilder().set(macro, "SQ", test::sequence_of({values}));
    };
    XaFile file = XaFile().erase(kPrimary).erase(kSecondary).erase(kPitch).erase(kSdd).erase(kSpd);
    file.frames = 2;
    for (int f = 0; f < 2; ++f) file.pixels.insert(file.pixels.end(), 1200, static_cast<std::uint16_t>(100 * (f + 1)));
    test::DicomBuilder pixels, shared = group(0x00289443, pixels.set(kPitch, "DS", "0.5\\0.4"));
    std::vector<test::DicomBuilder> frames;
    for (const auto& [primary, sdd, sid] : {std::tuple{"30", "1200", 800.0F}, {"40", "1300", 900.0F}}) {
        test::DicomBuilder positioner, distances;
        positioner.set(kPrimary, "DS", primary).set(kSecondary, "DS", "-20");
        distances.set(kSdd, "DS", sdd).set(0x00189402, "FL", test::bytes_of(sid));
        test::DicomBuilder frame = group(0x00189405, positioner);
        frame.tags.merge(group(0x00189476, distances).tags);
        frames.push_back(frame);
    }
    file.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.12.1.1");
    file.set(0x52009229, "SQ", test::sequence_of({shared})).set(0x52009230, "SQ", test::sequence_of(frames));
    const Eigen::Vector3d x(3, -2, 4);
    EXPECT_LT((stored_by(view_of(file), x) - stored_pixel(x)).norm(), 1e-9);
    const GeometryView second = view_of(file, {.item = 2});
    EXPECT_EQ(second.geometry.camera.sdd_mm, 1300);
    const double p = 40 * std::numbers::pi / 180, s = -20 * std::numbers::pi / 180;
    EXPECT_LT((source_world_mm(second.geometry) -
               -900 * Eigen::Vector3d(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s)))
                  .norm(),
              1e-9);
    EXPECT_EQ(read_xray(at("xa.dcm"), 2).image(0, 0), 200);
    EXPECT_THAT(message_of(file, {.item = 3}), HasSubstr("in [1, 2]"));
}

/// The X-ray that a detector would store: one exact line integral a pixel, rays drawn in LPS without any camera.
std::vector<std::uint16_t> stored_xray(const Phantom& phantom, int columns, int rows, double pitch_mm) {
    const double p = 30 * std::numbers::pi / 180, s = -20 * std::numbers::pi / 180;
    const Eigen::Vector3d to_detector(std::sin(p) * std::cos(s), -std::cos(p) * std::cos(s), std::sin(s));
    const Eigen::Vector3d right(std::cos(p), std::sin(p), 0), up = right.cross(-to_detector).normalized();
    const Eigen::Vector3d source = -800 * to_detector;
    std::vector<std::uint16_t> pixels;
    for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
            const Eigen::Vector3d at = 400 * to_detector + (x - (columns - 1) / 2.0) * pitch_mm * right -
                                       (y - (rows - 1) / 2.0) * pitch_mm * up;
            const double line_integral = exact_line_integral(phantom, source, (at - source).normalized());
            pixels.push_back(static_cast<std::uint16_t>(std::lround(60000 * std::exp(-line_integral))));
        }
    }
    return pixels;
}

TEST_F(DicomGeometry, AnXaFileOfAnotherWriterComesOutInPlaceAndTheRightWayUp) {
    XaFile file;
    file.columns = 90;
    file.rows = 100;
    file.set(kPitch, "DS", "1.8\\1.8");
    const Phantom letter = test::letter_phantom();
    file.pixels = stored_xray(letter, file.columns, file.rows, 1.8);
    test::write_with_gdcm(at("xa.dcm"), file);
    const std::vector<std::string> files{at("xa.dcm").string()};
    const ViewsFile views = read_views(files, ReadImages::required);
    ASSERT_EQ(views.views.size(), 1U);
    const Image expected = exact_drr(letter, views.views[0].geometry, {});
    const Image& found = views.views[0].image;
    double most = 0, mirrored = 0;
    for (int y = 0; y < found.height; ++y) {
        for (int x = 0; x < found.width; ++x) {
            most = std::max<double>(most, std::abs(found(x, y) - expected(x, y)));
            mirrored = std::max<double>(mirrored, std::abs(found(found.width - 1 - x, y) - expected(x, y)));
        }
    }
    EXPECT_LT(most, 1e-3);     // half a count of 60000 exp(-1.4), and I0 within one
    EXPECT_GT(mirrored, 0.3);  // the other way round it would not fit
    EXPECT_EQ(views.files.size(), 1U);
}

TEST_F(DicomGeometry, CutOffFilesAreRefused) {
    const std::string whole = XaFile().bytes();
    for (const std::size_t size : {std::size_t{140}, whole.size() / 4, whole.size() - 10}) {
        (void)write("cut.dcm", whole.substr(0, size));
        EXPECT_THAT(error_of([&] { (void)read_geometry(at("cut.dcm")); }), Not(HasSubstr("is mirrored"))) << size;
    }
}

}  // namespace
}  // namespace raylign::detail
