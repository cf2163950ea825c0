#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "io_files.h"
#include "raylign/io/geometry.h"
#include "xa_files.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::XaFile;
using testing::Contains;
using testing::HasSubstr;

class RtImage : public test::IoTest {
protected:
    [[nodiscard]] GeometryView view_of(const XaFile& file) const {
        return read_geometry(write("rt.dcm", file.bytes())).front();
    }
    [[nodiscard]] std::string message_of(const XaFile& file) const {
        return error_of([&] { (void)view_of(file); });
    }
};

/// Portal image: gantry 90, receptor 2 x 3 mm pixels at 1400 mm, first pixel's centre at (-39, 29) mm on the receptor.
TEST_F(RtImage, IsPlacedByItsOwnTags) {
    XaFile file;
    file.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.481.1")
        .set(0x30020022, "DS", "1000")
        .set(0x30020026, "DS", "1400");
    file.set(0x30020011, "DS", "3\\2").set(0x30020012, "DS", "-39\\29").set(0x300a011e, "DS", "90");
    file.set(0x300a012c, "DS", "1\\2\\3");
    const GeometryView view = view_of(file);
    EXPECT_LT((source_world_mm(view.geometry) - Eigen::Vector3d(1000, 0, 0)).norm(), 1e-9);
    // Seen from the patient's left: receptor x to the back, y to the head.
    const Eigen::Vector3d x(100, 20, 30);
    EXPECT_LT((project(view.geometry, x) - Eigen::Vector2d((20 * 1400.0 / 900 + 39) / 2, (29 - 30 * 1400.0 / 900) / 3))
                  .norm(),
              1e-9);
    EXPECT_EQ(view.isocentre_ct_mm, Eigen::Vector3d(1, 2, 3));
    EXPECT_THAT(message_of(XaFile(file).erase(0x300a011e)), HasSubstr("GantryAngle (300A,011E) is missing"));
    EXPECT_THAT(message_of(XaFile(file).set(0x3002000c, "CS", "NON_NORMAL")), HasSubstr("RTImagePlane"));
    EXPECT_THAT(message_of(XaFile(file).set(0x00185100, "CS", "SITTING")), HasSubstr("PatientPosition"));
    EXPECT_THAT(message_of(file.set(0x300a0122, "DS", "abc")), HasSubstr("PatientSupportAngle (300A,0122) = abc"));
}

/// Gantry at 0: rays go down. What is told here is told in the machine's fixed axes, without any camera.
XaFile rt_image_from_above() {
    XaFile file;
    file.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.481.1").set(0x30020022, "DS", "1000");
    file.set(0x30020026, "DS", "1400").set(0x30020011, "DS", "3\\2").set(0x30020012, "DS", "-39\\29");
    return file.set(0x300a011e, "DS", "0");
}

/// Stored pixel of a point in fixed axes, the receptor turned by `receptor_deg`.
Eigen::Vector2d rt_pixel(const Eigen::Vector3d& x_fixed, double receptor_deg = 0) {
    const Eigen::Vector2d shadow = x_fixed.head<2>() * 1400 / (1000 - x_fixed.z());
    const Eigen::Vector2d receptor = Eigen::Rotation2Dd(-receptor_deg * std::numbers::pi / 180) * shadow;
    return {(receptor.x() + 39) / 2, (29 - receptor.y()) / 3};
}

TEST_F(RtImage, CouchAndReceptorAnglesTurnTheRtImage) {
    const Eigen::Vector3d x(10, 20, 30);  // left, back, head: right of the couch's end, down, to the gantry
    const Eigen::Vector3d at_zero(10, 30, -20);
    EXPECT_LT((project(view_of(rt_image_from_above()).geometry, x) - rt_pixel(at_zero)).norm(), 1e-9);
    const auto turned = [&](double deg, const Eigen::Vector3d& axis) {
        return Eigen::AngleAxisd(deg * std::numbers::pi / 180, axis) * at_zero;
    };
    const Eigen::Vector3d to_right(1, 0, 0), to_gantry(0, 1, 0), up(0, 0, 1);
    const GeometryView couch = view_of(rt_image_from_above().set(0x300a0122, "DS", "30"));
    EXPECT_LT((project(couch.geometry, x) - rt_pixel(turned(30, up))).norm(), 1e-9);
    EXPECT_THAT(couch.assumptions, Contains(HasSubstr("PatientSupportAngle (300A,0122) = 30")));
    const auto with_float = [](std::uint32_t tag, float deg) {
        return rt_image_from_above().set(tag, "FL", test::bytes_of(deg));
    };
    EXPECT_LT((project(view_of(with_float(0x300a0140, 2)).geometry, x) - rt_pixel(turned(2, to_right))).norm(), 1e-9);
    EXPECT_LT((project(view_of(with_float(0x300a0144, 3)).geometry, x) - rt_pixel(turned(3, to_gantry))).norm(), 1e-9);
    const GeometryView receptor = view_of(rt_image_from_above().set(0x3002000e, "DS", "40"));
    EXPECT_LT((project(receptor.geometry, x) - rt_pixel(at_zero, 40)).norm(), 1e-9);
    const GeometryView collimator = view_of(rt_image_from_above().set(0x300a0120, "DS", "40"));
    EXPECT_LT((project(collimator.geometry, x) - rt_pixel(at_zero)).norm(), 1e-9);
}

TEST_F(RtImage, TheWorldOfAnRtImageIsThePatientsHoweverHeLies) {
    const Eigen::Vector3d x(10, 20, 30);
    const std::vector<std::pair<const char*, Eigen::Vector3d>> fixed = {
        {"HFS", {10, 30, -20}}, {"HFP", {-10, 30, 20}},   {"FFS", {-10, -30, -20}}, {"FFP", {10, -30, 20}},
        {"HFDR", {20, 30, 10}}, {"HFDL", {-20, 30, -10}}, {"FFDR", {-20, -30, 10}}, {"FFDL", {20, -30, -10}}};
    for (const auto& [position, x_fixed] : fixed) {
        const GeometryView view = view_of(rt_image_from_above().set(0x00185100, "CS", position));
        EXPECT_LT((project(view.geometry, x) - rt_pixel(x_fixed)).norm(), 1e-9) << position;
    }
}

}  // namespace
}  // namespace raylign::detail
