#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/geometry/camera.h"
#include "raylign/camera.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

constexpr double kExact_px = 1e-9;  // pixels near 1000 through an inverse

CArm c_arm(double primary_deg, double secondary_deg) {
    return {.sad_mm = 700,
            .sdd_mm = 1100,
            .primary_angle_deg = primary_deg,
            .secondary_angle_deg = secondary_deg,
            .pixel_pitch_mm = {0.4, 0.5},
            .size_px = {640, 480},
            .principal_point_px = {}};
}

/// A view that is skewed, off centre and anywhere.
ViewGeometry odd_view() {
    ViewGeometry view;
    view.camera = camera_from_pitch({640, 480}, 1100, {0.4, 0.5}, {300.25, 260.75});
    view.camera.intrinsics_px(0, 1) = 3;
    view.camera_from_world = exp((Twist() << 0.4, -1.2, 0.9, 20, -35, 710).finished());
    return view;
}

TEST(Camera, PixelProjectsToItselfAlongItsRay) {
    const ViewGeometry view = odd_view();
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 479), Eigen::Vector2d(17.25, 400.5)}) {
        const Eigen::Vector3d direction = ray_direction_world(view, pixel);
        EXPECT_NEAR(direction.norm(), 1, 1e-14);
        for (const double distance_mm : {1.0, 700.0, 5000.0}) {
            const Eigen::Vector3d x_world = source_world_mm(view) + distance_mm * direction;
            EXPECT_LT((project(view, x_world) - pixel).norm(), kExact_px);
        }
    }
}

TEST(Camera, PointsBehindTheSourceDoNotProject) {
    const ViewGeometry view = odd_view();
    const Eigen::Vector3d direction = ray_direction_world(view, {100, 100});
    EXPECT_TRUE(project(view, source_world_mm(view) - 10 * direction).array().isNaN().all());
    const ViewGeometry at_origin{view.camera, {}};
    EXPECT_TRUE(project(at_origin, {5, 5, 0}).array().isNaN().all());  // in the source's plane
}

TEST(Camera, PitchAndIntrinsicsAgree) {
    const Camera camera = camera_from_pitch({640, 480}, 1100, {0.4, 0.5}, {300.25, 260.75});
    EXPECT_EQ(camera.intrinsics_px(0, 0), 1100 / 0.4);
    EXPECT_EQ(camera.intrinsics_px(0, 2), 300.25);
    EXPECT_LT((camera.pixel_pitch_mm().value() - Eigen::Vector2d(0.4, 0.5)).norm(), 1e-15);
    EXPECT_FALSE(Camera{}.pixel_pitch_mm().has_value());
}

TEST(CArmView, StandsAsDocumentedAtZero) {
    const ViewGeometry view = view_from_c_arm(c_arm(0, 0));
    EXPECT_LT((source_world_mm(view) - Eigen::Vector3d(0, 700, 0)).norm(), 1e-12);  // under the table
    const Eigen::Vector2d middle(319.5, 239.5);
    EXPECT_LT((project(view, {0, 0, 0}) - middle).norm(), kExact_px);
    // 10 mm to the patient's right moves along the columns by the magnification, 10 mm to the feet along the rows.
    EXPECT_LT((project(view, {-10, 0, 0}) - middle - Eigen::Vector2d(10 * 11.0 / 7 / 0.4, 0)).norm(), kExact_px);
    EXPECT_LT((project(view, {0, 0, -10}) - middle - Eigen::Vector2d(0, 10 * 11.0 / 7 / 0.5)).norm(), kExact_px);
}

TEST(CArmView, AnglesTurnTheDetectorAsDicomDefinesThem) {
    // Towards the detector, from the isocentre: the camera's z axis in world.
    const auto detector = [](double primary, double secondary) -> Eigen::Vector3d {
        return view_from_c_arm(c_arm(primary, secondary)).camera_from_world.rotation.row(2);
    };
    const double h = std::sqrt(0.5);
    EXPECT_LT((detector(0, 0) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-14);     // anterior
    EXPECT_LT((detector(90, 0) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-14);     // LAO 90: left
    EXPECT_LT((detector(45, 0) - Eigen::Vector3d(h, -h, 0)).norm(), 1e-14);    // LAO 45
    EXPECT_LT((detector(-45, 0) - Eigen::Vector3d(-h, -h, 0)).norm(), 1e-14);  // RAO 45
    EXPECT_LT((detector(0, 45) - Eigen::Vector3d(0, -h, h)).norm(), 1e-14);    // CRA 45: towards the head
    EXPECT_LT((detector(0, -45) - Eigen::Vector3d(0, -h, -h)).norm(), 1e-14);  // CAU 45
    EXPECT_LT((detector(90, 45) - Eigen::Vector3d(h, 0, h)).norm(), 1e-14);    // secondary within the turned plane
}

TEST(CArmView, RotatesAboutTheIsocentre) {
    for (const auto& [primary, secondary] : {std::pair(30.0, 20.0), {-120.0, 45.0}, {180.0, -90.0}}) {
        const ViewGeometry view = view_from_c_arm(c_arm(primary, secondary));
        EXPECT_NEAR(source_world_mm(view).norm(), 700, 1e-10);
        EXPECT_LT((view.camera_from_world * Eigen::Vector3d::Zero() - Eigen::Vector3d(0, 0, 700)).norm(), 1e-12);
        EXPECT_NEAR(view.camera_from_world.rotation.determinant(), 1, 1e-14);
    }
}

TEST(ProjectionMatrix, RoundTripsUnderAnyScaleAndSign) {
    const ViewGeometry view = odd_view();
    for (const double scale : {1.0, -1.0, 1e-6, -2e7}) {
        const ViewGeometry back =
            view_from_projection_matrix(scale * projection_matrix(view), view.camera.size_px, "test");
        EXPECT_LT((back.camera.intrinsics_px - view.camera.intrinsics_px).cwiseAbs().maxCoeff(), 1e-8) << scale;
        EXPECT_LT((back.camera_from_world.rotation - view.camera_from_world.rotation).cwiseAbs().maxCoeff(), 1e-12);
        EXPECT_LT((back.camera_from_world.translation_mm - view.camera_from_world.translation_mm).norm(), 1e-8);
        EXPECT_FALSE(back.camera.sdd_mm.has_value());
        EXPECT_NO_THROW(check_camera(back.camera, "test"));
    }
}

TEST(ProjectionMatrix, RoundTripsForRandomCameras) {
    Random random(21);
    for (int i = 0; i < 200; ++i) {
        ViewGeometry view;
        view.camera =
            camera_from_pitch({512, 512}, random.uniform(500, 2000), {random.uniform(0.1, 1), random.uniform(0.1, 1)},
                              {random.uniform(-100, 700), random.uniform(-100, 700)});
        Twist twist;
        twist << random.uniform(0, 3.1) * random.direction(), 800 * random.direction();
        view.camera_from_world = exp(twist);
        const ViewGeometry back = view_from_projection_matrix(projection_matrix(view), view.camera.size_px, "test");
        EXPECT_LT((projection_matrix(back) - projection_matrix(view)).norm() / projection_matrix(view).norm(), 1e-12);
        EXPECT_GT(back.camera.intrinsics_px.diagonal().minCoeff(), 0);
    }
}

TEST(ProjectionMatrix, GivesPixelAndDepth) {
    const ViewGeometry view = odd_view();
    const Eigen::Vector3d x_world(5, -6, 7);
    const Eigen::Vector3d h = projection_matrix(view) * x_world.homogeneous();
    EXPECT_LT((h.hnormalized() - project(view, x_world)).norm(), kExact_px);
    EXPECT_NEAR(h.z(), (view.camera_from_world * x_world).z(), 1e-10);
}

TEST(ProjectionMatrix, RefusesSingularAndNonFiniteOnes) {
    Eigen::Matrix<double, 3, 4> p = projection_matrix(odd_view());
    p.col(1) = 2 * p.col(0);
    EXPECT_THROW((void)view_from_projection_matrix(p, {512, 512}, "p.txt"), Error);
    p = projection_matrix(odd_view());
    p(0, 3) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW((void)view_from_projection_matrix(p, {512, 512}, "p.txt"), Error);
    EXPECT_THROW((void)view_from_projection_matrix(Eigen::Matrix<double, 3, 4>::Zero(), {512, 512}, "p.txt"), Error);
}

TEST(HalfResolutionCamera, SeesAnAveragedPixelAtTheMiddleOfItsFour) {
    const ViewGeometry view = odd_view();
    const ViewGeometry half{half_resolution(view.camera), view.camera_from_world};
    EXPECT_EQ(half.camera.size_px, Eigen::Vector2i(320, 240));
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0, 0), Eigen::Vector2d(319, 239), Eigen::Vector2d(7, 100)}) {
        const Eigen::Vector2d middle = 2 * pixel + Eigen::Vector2d(0.5, 0.5);
        EXPECT_LT((ray_direction_world(half, pixel) - ray_direction_world(view, middle)).norm(), 1e-14);
    }
    EXPECT_LT((half.camera.pixel_pitch_mm().value() - Eigen::Vector2d(0.8, 1.0)).norm(), 1e-14);
    EXPECT_EQ(half_resolution(Camera{{7, 5}, view.camera.intrinsics_px, {}}).size_px, Eigen::Vector2i(3, 2));
}

TEST(FinerCamera, SeesThePixelAtTheMiddleOfThoseInItsPlace) {
    const ViewGeometry view = odd_view();
    const ViewGeometry fine{finer(view.camera, 3), view.camera_from_world};
    EXPECT_EQ(fine.camera.size_px, Eigen::Vector2i(1920, 1440));
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 479), Eigen::Vector2d(7, 100)}) {
        const Eigen::Vector2d middle = 3 * pixel + Eigen::Vector2d(1, 1);
        EXPECT_LT((ray_direction_world(fine, middle) - ray_direction_world(view, pixel)).norm(), 1e-14);
    }
}

void expect_refused(const Camera& camera, const std::string& reason) {
    EXPECT_THAT(test::error_of([&] { check_camera(camera, "view 3"); }),
                testing::AllOf(testing::HasSubstr(reason), testing::HasSubstr("view 3")));
}

TEST(CheckCamera, NamesWhatIsWrong) {
    const Camera good = odd_view().camera;
    EXPECT_NO_THROW(check_camera(good, "view 3"));
    Camera bad = good;
    bad.size_px.y() = 0;
    expect_refused(bad, "640 x 0");
    bad = good;
    bad.intrinsics_px(0, 0) = -5;
    expect_refused(bad, "fx");
    bad = good;
    bad.intrinsics_px(1, 1) = 0;
    expect_refused(bad, "fy");
    bad = good;
    bad.intrinsics_px(0, 2) = std::nan("");
    expect_refused(bad, "finite");
    bad = good;
    bad.intrinsics_px(2, 0) = 1e-3;
    expect_refused(bad, "triangular");
    bad = good;
    bad.sdd_mm = 0;
    expect_refused(bad, "sdd_mm");
    bad.sdd_mm = std::numeric_limits<double>::infinity();
    expect_refused(bad, "sdd_mm");
}

}  // namespace
}  // namespace raylign::detail
