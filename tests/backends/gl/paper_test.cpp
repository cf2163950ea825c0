// gl-2006: the paper's pipeline and what it was compared with.

#include <gtest/gtest.h>

#include "backends/gl/paper_pipeline.h"
#include "core/base/error.h"
#include "gl_scenes.h"
#include "tests/support/image_compare.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::gl {
namespace {

class Gl2006 : public testing::Test {
protected:
    void SetUp() override {
        RAYLIGN_NEED_GL(api);
        api_ = api;
        context_ = open_device(api, {});
    }
    [[nodiscard]] std::unique_ptr<Session> session(const PaperOptions& options,
                                                   Projector projector = Projector::trilinear,
                                                   Metric metric = Metric::gc) const {
        return std::make_unique<PaperSession>(context_, spine_.scene(projector, metric), options);
    }
    [[nodiscard]] std::unique_ptr<Session> oracle(Projector projector, Metric metric = Metric::gc) const {
        return create_backend("reference").backend->prepare(spine_.scene(projector, metric));
    }

    Api api_;
    std::shared_ptr<Context> context_;
    test::SpineScene spine_{32, 45};
};

TEST_F(Gl2006, BothKindsOfSlicesGiveTheImagesOfTheReference) {
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        for (const bool exact : {true, false}) {
            if (!exact && context_->device().filter_bits > 0)
                continue;  // 8-bit fractions: GlAccuracy has their tolerance
            const auto ours = session({.storage = Storage::float32, .exact = exact}, projector);
            const auto theirs = oracle(projector);
            for (int i = 0; i < 4; ++i) {
                const RigidTransform pose = exp((Twist() << 0.5 * i, 0.9 * i, -0.4 * i, 3, -2, i).finished());
                EXPECT_TRUE(
                    test::images_near(ours->render(pose, i % 2), theirs->render(pose, i % 2), test::kFloatImageShare))
                    << projector_name(projector) << ", pose " << i;
            }
        }
    }
}

TEST_F(Gl2006, ASourceInsideTheVolumeAndADetectorThatCutsItAreRespected) {
    spine_.views[0].geometry.camera_from_world.translation_mm.z() = 40;  // the source is in the spine
    spine_.views[1].geometry.camera.sdd_mm = 1010;                       // and this detector, too
    spine_.views[0].image = spine_.views[1].image = {};
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto ours = session({.storage = Storage::float32, .exact = true}, projector);
        const auto theirs = oracle(projector);
        for (std::size_t view = 0; view < 2; ++view) {
            const RigidTransform pose = spine_.poses(1)[0];
            EXPECT_TRUE(test::images_near(ours->render(pose, view), theirs->render(pose, view), 5e-5)) << view;
        }
    }
}

TEST_F(Gl2006, AllReductionsGiveTheSameCostsWithinTheirPrecision) {
    const auto poses = spine_.poses(4);
    for (const Metric metric : {Metric::gc, Metric::ncc}) {
        const auto expected = test::costs(*oracle(Projector::trilinear, metric), poses);
        const auto check = [&](const PaperOptions& options, double tolerance) {
            const auto found = test::costs(*session(options, Projector::trilinear, metric), poses);
            for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << i;
        };
        const PaperOptions plain{.storage = Storage::float32, .exact = true};
        check(plain, test::kCost);
        PaperOptions other = plain;
        other.reduction = Reduction::mipmap;
        check(other, test::kCost);
        other = plain;
        other.read_images = true;
        check(other, test::kCost);
    }
}

TEST_F(Gl2006, HalfFloatsAreWorseAsTheyWereIn2005) {
    const auto poses = spine_.poses(4);
    const auto expected = test::costs(*oracle(Projector::trilinear), poses);
    const auto half =
        test::costs(*session({.storage = Storage::float32, .exact = true, .reduction = Reduction::mipmap_half}), poses);
    double worst = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) worst = std::max(worst, std::abs(half[i] - expected[i]));
    EXPECT_GT(worst, 1e-4) << "eleven bits cannot be better than that";
    EXPECT_LT(worst, 0.3) << "and yet it is the same measure";
}

TEST_F(Gl2006, TwentyBytesComeBackPerGradientImage) {
    const auto sums = session({});
    (void)test::costs(*sums, spine_.poses(5));
    EXPECT_EQ(sums->counters().bytes_to_host, 20u * 5 * 2 * 2) << "poses, views, gradients";
    const auto images = session({.read_images = true});
    (void)test::costs(*images, spine_.poses(5));
    EXPECT_EQ(images->counters().bytes_to_host, 4u * 45 * 45 * 5 * 2 * 2) << "what the reductions save";
}

TEST_F(Gl2006, OddAndLongImagesAreReducedWhole) {
    for (const auto& [width, height] : {std::pair{31, 7}, {28, 82}, {9, 27}, {64, 3}}) {
        for (View& view : spine_.views) {
            view.geometry = view_from_c_arm({.sad_mm = 1000,
                                             .sdd_mm = 1500,
                                             .primary_angle_deg = view.name == "AP" ? 0.0 : 90.0,
                                             .secondary_angle_deg = 0,
                                             .pixel_pitch_mm = {4, 4},
                                             .size_px = {width, height}});
            view.image = exact_drr(spine_phantom({160, 160, 160}), view.geometry, test::oblique_pose());
        }
        const auto poses = spine_.poses(2);
        const auto scene = Scene{spine_.volume, spine_.views, {Projector::trilinear, {}}, {Metric::ncc, {}}};
        const auto expected = create_backend("reference").backend->prepare(scene)->moment_sums(poses);
        for (const Reduction reduction : {Reduction::passes, Reduction::mipmap}) {
            PaperSession ours(context_, scene, {.storage = Storage::float32, .exact = true, .reduction = reduction});
            const auto found = ours.moment_sums(poses);
            for (std::size_t i = 0; i < found.size(); ++i) {
                EXPECT_NEAR(found[i].fixed_moving, expected[i].fixed_moving, 3e-5 * expected[i].fixed_moving);
                EXPECT_NEAR(found[i].moving, expected[i].moving, 3e-5 * expected[i].moving) << width << " x " << height;
            }
        }
    }
}

TEST_F(Gl2006, NewWeightsCountAtOnce) {
    const auto ours = session({.storage = Storage::float32, .exact = true}), theirs = oracle(Projector::trilinear);
    const auto poses = spine_.poses(2);
    const auto before = test::costs(*ours, poses);
    std::vector<Image> weights(2, Image(45, 45, 1));
    for (Image& image : weights) {
        for (int i = 0; i < 45 * 45; ++i) image.pixels[i] = i * 7 % 5 * 0.25F;
    }
    ours->set_weights(weights);
    theirs->set_weights(weights);
    const auto found = test::costs(*ours, poses), expected = test::costs(*theirs, poses);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_NE(found[i], before[i]);
        EXPECT_NEAR(found[i], expected[i], test::kCost);
    }
}

TEST_F(Gl2006, SlicesThatDoNotFitTheProjectorAreRefused) {
    Gl2006Options options;
    options.slices = Gl2006Options::Slices::view_aligned;
    const auto backend = make_gl_2006_backend(api_, options);
    EXPECT_NE(backend->prepare(spine_.scene(Projector::trilinear)), nullptr);
    try {
        (void)backend->prepare(spine_.scene(Projector::joseph));
        FAIL() << "must throw";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("object-aligned"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace raylign::detail::gl
