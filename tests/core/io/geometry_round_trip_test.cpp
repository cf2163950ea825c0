#include <gmock/gmock.h>

#include <functional>

#include "io_files.h"
#include "raylign/io/geometry.h"
#include "raylign/io/views.h"
#include "tests/support/letter_phantom.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::HasSubstr;

/// A camera off every axis: odd size, pixels that are not square, principal point beside the middle, in-plane turn.
ViewGeometry odd_view() {
    ViewGeometry view = view_from_c_arm({.sad_mm = 780,
                                         .sdd_mm = 1180,
                                         .primary_angle_deg = 33,
                                         .secondary_angle_deg = -17,
                                         .pixel_pitch_mm = {2.9, 2.1},
                                         .size_px = {61, 84},
                                         .principal_point_px = Eigen::Vector2d(33.25, 39.75)});
    Twist turn;
    turn << 0.02, -0.03, 0.4, 11, -6, 4;
    view.camera_from_world = exp(turn) * view.camera_from_world;
    return view;
}

double largest_difference(const Image& a, const Image& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        most = std::max<double>(most, std::abs(a.pixels[i] - b.pixels[i]));
    return most;
}

struct Format {
    const char* name;
    const char* file;
    std::function<std::string(const ViewGeometry&)> text;
    bool keeps_sdd = true;
    bool lacks_size = false, lacks_pitch = false;
};

class GeometryRoundTrip : public test::IoTest, public testing::WithParamInterface<Format> {};

/// One scene, described in every format, must look the same: through the file and back the X-ray of the letter stays
/// within what the digits of the file allow, and the letter is neither mirrored nor turned.
TEST_P(GeometryRoundTrip, TheSceneLooksTheSame) {
    const ViewGeometry view = odd_view();
    const Format& format = GetParam();
    GeometryHints hints;
    if (format.lacks_size) hints.size_px = view.camera.size_px;
    if (format.lacks_pitch) hints.pixel_pitch_mm = view.camera.pixel_pitch_mm();
    if (!format.keeps_sdd) hints.sdd_mm = view.camera.sdd_mm;
    const std::vector<GeometryView> back = read_geometry(write(format.file, format.text(view)), hints);
    ASSERT_EQ(back.size(), 1U);
    EXPECT_LT((projection_matrix(back[0].geometry) - projection_matrix(view)).norm() / projection_matrix(view).norm(),
              1e-12);
    EXPECT_NEAR(*back[0].geometry.camera.sdd_mm, *view.camera.sdd_mm, 1e-9);
    const Phantom letter = test::letter_phantom();
    const Image before = exact_drr(letter, view, {}), after = exact_drr(letter, back[0].geometry, {});
    EXPECT_GT(*std::ranges::max_element(before.pixels), 0.3);
    EXPECT_LT(largest_difference(before, after), 1e-6);
}

std::string rtk_of(const ViewGeometry& view) {
    std::vector<std::string> notes;
    return rtk_text(std::vector<ViewGeometry>{view}, notes);
}

std::string opencv_text_of(const ViewGeometry& view) { return opencv_text(view); }

std::string vectors_text_of(const ViewGeometry& view) { return vectors_text({&view, 1}, {}); }

INSTANTIATE_TEST_SUITE_P(Formats, GeometryRoundTrip,
                         testing::Values(Format{"MayaCam2", "a.txt", mayacam2_text, false},
                                         Format{"OpenCV", "a.yml", opencv_text_of, false},
                                         Format{"Vectors", "a.csv", vectors_text_of},
                                         Format{"plastimatch", "a.txt", plastimatch_text, true, true},
                                         Format{"RTK", "a.xml", rtk_of, true, true, true}),
                         [](const auto& named) { return std::string(named.param.name); });

using GeometryWriters = test::IoTest;

TEST_F(GeometryWriters, RtkKeepsAViewStraightFromAbove) {
    // Gantry and in-plane axes coincide: the angles are not unique, the camera is.
    const ViewGeometry above = view_from_c_arm(
        {.sad_mm = 800, .sdd_mm = 1200, .secondary_angle_deg = 90, .pixel_pitch_mm = {1, 1}, .size_px = {40, 30}});
    Eigen::Matrix3d lying;  // RTK's rotation axis is y: the beam along it
    lying << 1, 0, 0, 0, 0, 1, 0, -1, 0;
    const ViewGeometry view{above.camera, above.camera_from_world * RigidTransform{lying, Eigen::Vector3d::Zero()}};
    const GeometryView back = read_geometry(write("a.xml", rtk_of(view)), {.size_px = Eigen::Vector2i(40, 30),
                                                                           .pixel_pitch_mm = Eigen::Vector2d(1, 1)})
                                  .front();
    EXPECT_LT((projection_matrix(back.geometry) - projection_matrix(view)).norm() / projection_matrix(view).norm(),
              1e-9);
}

TEST_F(GeometryWriters, WhatAFormatCannotHoldIsRefused) {
    ViewGeometry view = odd_view();
    view.camera.intrinsics_px(0, 1) = 5;
    EXPECT_THAT(error_of([&] { (void)plastimatch_text(view); }), HasSubstr("skewed"));
    EXPECT_THAT(error_of([&] { (void)rtk_of(view); }), HasSubstr("skewed"));
    view = odd_view();
    view.camera.sdd_mm.reset();
    EXPECT_THAT(error_of([&] { (void)plastimatch_text(view); }), HasSubstr("sdd_mm"));
    EXPECT_THAT(error_of([&] { (void)rtk_of(view); }), HasSubstr("sdd_mm"));
}

}  // namespace
}  // namespace raylign::detail
