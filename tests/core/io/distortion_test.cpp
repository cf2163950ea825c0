#include "core/io/geometry/distortion.h"

#include <gmock/gmock.h>

#include <cmath>

#include "io_files.h"
#include "raylign/io/frames.h"
#include "raylign/io/image.h"
#include "raylign/io/views.h"
#include "views_text.h"

namespace raylign::detail {
namespace {

using test::error_of;
using test::replaced;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

constexpr int kWidth = 90, kHeight = 70;
const Camera kCamera{{kWidth, kHeight}, (Eigen::Matrix3d() << 120, 0, 46, 0, 115, 33, 0, 0, 1).finished(), 1000};
const Distortion kBarrel{-0.21, 0.09, 0.001, -0.002, 0.01};
const Distortion kRational{0.3, -0.05, -0.001, 0.002, 0.01, 0.4, 0.02, -0.01};

/// The model written out once more, from OpenCV's documentation.
Eigen::Vector2d by_hand(const Distortion& d, const Eigen::Vector2d& pixel) {
    const double x = (pixel.x() - 46) / 120, y = (pixel.y() - 33) / 115, r2 = x * x + y * y;
    const double radial = (1 + d.k1 * r2 + d.k2 * r2 * r2 + d.k3 * std::pow(r2, 3)) /
                          (1 + d.k4 * r2 + d.k5 * r2 * r2 + d.k6 * std::pow(r2, 3));
    const double u = x * radial + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x);
    const double v = y * radial + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y;
    return {120 * u + 46, 115 * v + 33};
}

TEST(DistortionModel, IsOpencvsAndInvertible) {
    for (const Distortion& d : {kBarrel, kRational}) {
        for (double y = 0; y < kHeight; y += 7.5) {
            for (double x = 0; x < kWidth; x += 7.5) {
                const Eigen::Vector2d pixel(x, y), moved = distorted_px(kCamera, d, pixel);
                EXPECT_LT((moved - by_hand(d, pixel)).norm(), 1e-10);
                EXPECT_LT((undistorted_px(kCamera, d, moved) - pixel).norm(), 1e-6);
            }
        }
    }
}

TEST(DistortionModel, NoPointIsMadeUpWhereTheModelFoldsBack) {
    const Distortion strong{-2};
    EXPECT_THAT(error_of([&] {
                    (void)undistorted_px(kCamera, strong, {46 + 500, 33});
                }),
                AllOf(HasSubstr("(546, 33) px"), HasSubstr("k1 -2")));
}

TEST(DistortionModel, TurnsWithTheImage) {
    for (const ImageFlip flip : {ImageFlip::columns, ImageFlip::rows}) {
        Camera turned = kCamera;
        const int axis = flip == ImageFlip::columns ? 0 : 1;
        turned.intrinsics_px(axis, 2) = kCamera.size_px[axis] - 1 - kCamera.intrinsics_px(axis, 2);
        const auto turn = [&](Eigen::Vector2d pixel) {
            pixel[axis] = kCamera.size_px[axis] - 1 - pixel[axis];
            return pixel;
        };
        const Eigen::Vector2d pixel(71, 12);
        EXPECT_LT(
            (distorted_px(turned, flipped(kBarrel, flip), turn(pixel)) - turn(distorted_px(kCamera, kBarrel, pixel)))
                .norm(),
            1e-10);
    }
}

/// Spots of 2 px, drawn where the model moves them.
Image spots(const std::vector<Eigen::Vector2d>& centres) {
    Image image(kWidth, kHeight, 10);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            for (const Eigen::Vector2d& c : centres) {
                image(x, y) +=
                    200 * static_cast<float>(std::exp(-(Eigen::Vector2d(x, y) - c).squaredNorm() / (2 * 2 * 2)));
            }
        }
    }
    return image;
}

Eigen::Vector2d centroid_near(const Image& image, const Eigen::Vector2d& place) {
    constexpr int kRadius = 7;
    double weight = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int y = static_cast<int>(place.y()) - kRadius; y <= place.y() + kRadius; ++y) {
        for (int x = static_cast<int>(place.x()) - kRadius; x <= place.x() + kRadius; ++x) {
            const double value = image(x, y) - 10;
            weight += value;
            sum += value * Eigen::Vector2d(x, y);
        }
    }
    return sum / weight;
}

const std::vector<Eigen::Vector2d> kPlaces = {{20, 18}, {46, 33}, {70, 50}, {22, 52}, {68, 16}};

TEST(Undistortion, SpotsComeToLieWhereACameraWithoutDistortionSeesThem) {
    for (const Distortion& d : {kBarrel, kRational}) {
        std::vector<Eigen::Vector2d> moved;
        double most = 0;
        for (const Eigen::Vector2d& place : kPlaces) {
            moved.push_back(by_hand(d, place));
            most = std::max(most, (moved.back() - place).norm());
        }
        ASSERT_GT(most, 0.2) << "there is something to undo";
        const Image back = undistorted_image(spots(moved), undistortion_map(kCamera, d));
        for (const Eigen::Vector2d& place : kPlaces) {
            EXPECT_LT((centroid_near(back, place) - place).norm(), 0.05) << place.transpose();
        }
    }
}

TEST(Undistortion, WhatTheStoredImageDoesNotShowIsNotMadeUp) {
    const Distortion pincushion{0.5};
    const PixelMap map = undistortion_map(kCamera, pincushion);
    const Image back = undistorted_image(Image(kWidth, kHeight, 7), map);
    const Image mask = undistorted_mask(Image(kWidth, kHeight, 1), map);
    EXPECT_TRUE(std::isnan(back(0, 0)));
    EXPECT_EQ(mask(0, 0), 0);
    EXPECT_EQ(back(46, 33), 7);
    EXPECT_EQ(mask(46, 33), 1);
    for (std::size_t i = 0; i < back.pixels.size(); ++i)
        EXPECT_EQ(std::isnan(back.pixels[i]), mask.pixels[i] == 0) << i;
    // Strong barrels fold the corners back onto the image: no second copy of it.
    EXPECT_TRUE(
        std::isnan(undistorted_image(Image(kWidth, kHeight, 7), undistortion_map(kCamera, Distortion{-3}))(0, 0)));
}

TEST(Undistortion, MasksKeepOnlyWhatIsAllUsed) {
    Image mask(kWidth, kHeight, 1);
    for (int y = 0; y < kHeight; ++y) mask(30, y) = 0;
    const Image back = undistorted_mask(mask, undistortion_map(kCamera, Distortion{-0.01}));
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            const Eigen::Vector2d place = by_hand(Distortion{-0.01}, Eigen::Vector2d(x, y));
            const double distance = std::abs(place.x() - 30);
            if (distance < 0.99 || distance > 1.01) {
                EXPECT_EQ(back(x, y), distance < 1 ? 0 : 1) << x << ", " << y;
            }
        }
    }
}

TEST(DistortionCoefficients, AreFourFiveOrEight) {
    const std::vector<double> all = {1, 2, 3, 4, 5, 6, 7, 8, 0, 0, 0, 0, 0, 0};
    const auto from = [&](std::size_t count) { return distortion_from(std::span(all).first(count), "D", "a.yml"); };
    EXPECT_EQ(from(4)->k3, 0);
    EXPECT_EQ(from(5)->k3, 5);
    EXPECT_EQ(from(8)->k6, 8);
    EXPECT_EQ(from(14)->p2, 4);
    EXPECT_EQ(distortion_from(std::vector<double>(5, 0.0), "D", "a.yml"), std::nullopt);
    EXPECT_THAT(error_of([&] { (void)from(3); }), AllOf(HasSubstr("number of D = 3"), HasSubstr("a.yml")));
    const std::vector<double> prism = {1, 2, 3, 4, 5, 6, 7, 8, 0, 0.1, 0, 0};
    EXPECT_THAT(error_of([&] { (void)distortion_from(prism, "D", "a.yml"); }), HasSubstr("thin prisms"));
}

/// Writes a float image; line integrals stay as they are.
class DistortedViews : public test::IoTest {
protected:
    void SetUp() override {
        IoTest::SetUp();
        std::vector<Eigen::Vector2d> moved;
        for (const Eigen::Vector2d& place : kPlaces) moved.push_back(by_hand(kBarrel, place));
        write_image(at("spots.tif"), spots(moved));
        Image mask(kWidth, kHeight, 1);
        for (int x = 0; x < kWidth; ++x) mask(x, 0) = 0;
        write_image(at("mask.tif"), mask);
    }
    const std::string view_ = R"({"name": "A", "image": "spots.tif", "size_px": [90, 70], "sdd_mm": 1000,
        "intensity": {"kind": "line-integral", "polarity": "bone-bright"},
        "intrinsics": [[120, 0, 46], [0, 115, 33], [0, 0, 1]],
        "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,900],[0,0,0,1]],
        "distortion": [-0.21, 0.09, 0.001, -0.002, 0.01]})";
};

TEST_F(DistortedViews, ViewsJsonUndoesItsDistortion) {
    const ViewsFile file = read_views(write("v.json", test::views_json(view_)), ReadImages::required);
    for (const Eigen::Vector2d& place : kPlaces) {
        EXPECT_LT((centroid_near(file.views[0].image, place) - place).norm(), 0.05);
    }
    ASSERT_TRUE(file.origins[0].distortion);
    EXPECT_EQ(file.origins[0].distortion->p2, -0.002);
    const std::string masked = replaced(view_, R"("size_px")", R"("mask": "mask.tif", "size_px")");
    const Image weights = read_views(write("m.json", test::views_json(masked)), ReadImages::required).views[0].weights;
    EXPECT_EQ(weights(46, 0), 0);
    EXPECT_EQ(weights(46, 33), 1);
}

TEST_F(DistortedViews, FramesAreUndistortedAsImagesAre) {
    const auto path = write("v.json", test::views_json(view_));
    const ViewsFile file = read_views(std::vector<std::string>{path.string()}, ReadImages::frames);
    InstantReader reader(file);
    const Instant instant = reader.read(pair_frames(file, {}).front());
    ASSERT_EQ(instant.gap, "");
    for (const Eigen::Vector2d& place : kPlaces) {
        EXPECT_LT((centroid_near(instant.views[0].image, place) - place).norm(), 0.05);
    }
}

TEST_F(DistortedViews, DistortionGoesWithAPinholeOnly) {
    const std::string arm = R"({"name": "A", "c_arm": {"sad_mm": 800, "sdd_mm": 1200, "primary_angle_deg": 0,
        "secondary_angle_deg": 0, "pixel_pitch_mm": [1, 1], "size_px": [9, 7]}, "distortion": [0.1, 0, 0, 0]})";
    EXPECT_THAT(error_of([&] { (void)read_views(write("a.json", test::views_json(arm)), ReadImages::never); }),
                HasSubstr("views[0].distortion"));
    EXPECT_THAT(error_of([&] {
                    (void)read_views(
                        write("c.json", test::views_json(replaced(view_, "0.09, 0.001, -0.002, 0.01", "0"))),
                        ReadImages::never);
                }),
                AllOf(HasSubstr("number of views[0].distortion = 2"), HasSubstr("4, 5 or 8")));
}

TEST_F(DistortedViews, WhatIsWrittenReadsBack) {
    const ViewsFile file = read_views(write("v.json", test::views_json(view_)), ReadImages::never);
    write_views(at("w.json"), file.views, {}, {}, {file.origins[0].distortion});
    const ViewsFile again = read_views(at("w.json"), ReadImages::never);
    ASSERT_TRUE(again.origins[0].distortion);
    EXPECT_EQ(again.origins[0].distortion->k3, 0.01);
    EXPECT_EQ(again.origins[0].distortion->k1, -0.21);
}

}  // namespace
}  // namespace raylign::detail
