// Two vertebrae that lie over each other in both views, each on a path of its own: alone the fainter one is led astray
// by the other's edges.

#include "core/tracking/company.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "core/image/pyramid.h"
#include "core/image/region.h"
#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "raylign/targets.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

constexpr double kInCompany_mm = 0.5;  // voxels of 2 mm; measured up to 0.35
constexpr double kAstray = 1.7;        // times the errors together; measured 2.4
constexpr double kDenser = 3;          // the second, than the first
constexpr double kCoarser = 0.12;      // of what is hidden: a ray a pixel for the mean of four; measured up to 0.09
constexpr int kFrames = 7;

TrackFrame frame_of(int number, TrackStatus status) { return {.frame = number, .status = status}; }

Whereabouts whereabouts_after(const std::vector<TrackStatus>& statuses) {
    Prospect prospect;
    for (std::size_t i = 0; i < statuses.size(); ++i) prospect.remember(frame_of(static_cast<int>(i), statuses[i]));
    return prospect.whereabouts();
}

TEST(Prospect, IsNearAfterTwoSureFramesAndUnknownOnceLost) {
    using enum TrackStatus;
    EXPECT_EQ(whereabouts_after({}), Whereabouts::start);
    EXPECT_EQ(whereabouts_after({missing}), Whereabouts::start);
    EXPECT_EQ(whereabouts_after({ok}), Whereabouts::rough);
    EXPECT_EQ(whereabouts_after({ok, ok}), Whereabouts::near);
    EXPECT_EQ(whereabouts_after({ok, ok, doubtful}), Whereabouts::rough);
    EXPECT_EQ(whereabouts_after({ok, ok, missing}), Whereabouts::rough);
    EXPECT_EQ(whereabouts_after({ok, ok, lost}), Whereabouts::unknown);
    EXPECT_EQ(whereabouts_after({ok, ok, lost, missing}), Whereabouts::unknown);
    EXPECT_EQ(whereabouts_after({ok, lost, ok}), Whereabouts::rough);
}

/// Bones of 2 mm voxels in two noisy views of 128 x 128 pixels.
struct Pair {
    Pair() {
        const Eigen::Vector3d extent_mm = Eigen::Vector3d::Constant(200);
        for (std::size_t k = 0; k < 2; ++k) {
            bones.push_back(spine_vertebra(extent_mm, static_cast<int>(k) + 1));
            const Volume whole = voxelise(bones[k], centred_grid({100, 100, 100}, {2, 2, 2}), 2);
            volumes.push_back(crop(whole, box_of_object(whole)));
            for (float& value : volumes[k].attenuation_per_mm) value *= static_cast<float>(density(k));
            targets.push_back(default_targets_ct_mm(volumes[k]));
        }
        options.registration.content = Content::part;
        options.registration.search.mode = Search::none;
        options.recovery = Search::none;
    }
    static double density(std::size_t k) { return k == 0 ? 1 : kDenser; }
    /// The second is pushed over the first, and turned.
    [[nodiscard]] RigidTransform path(std::size_t k, int frame) const {
        const Eigen::Vector3d centre = volumes[k].grid.centre_ct_mm();
        const double phase = 0.15 * frame, sign = k == 0 ? 1 : -1;
        Twist twist;
        twist << 0.08 * sign * std::sin(phase), 0.02 * frame, 0.3 * sign, 4 * sign * std::sin(phase),
            1.2 * sign * frame - 4 * sign, k == 0 ? 0 : shift_mm;
        return exp_about(twist, centre);
    }
    [[nodiscard]] std::vector<View> xrays(int frame) const {
        std::vector<View> views = geometry;
        for (std::size_t v = 0; v < views.size(); ++v) {
            views[v].image = exact_drr(bones[0], views[v].geometry, path(0, frame));
            const Image other = exact_drr(bones[1], views[v].geometry, path(1, frame));
            for (std::size_t i = 0; i < other.pixels.size(); ++i)
                views[v].image.pixels[i] += static_cast<float>(density(1)) * other.pixels[i];
            views[v].image = with_photon_noise(views[v].image, 50000, static_cast<std::uint64_t>(10 * frame) + v);
        }
        return views;
    }
    [[nodiscard]] double mtre_mm(std::size_t k, const TrackFrame& frame) const {
        return mean_target_error_mm(frame.world_from_ct, path(k, frame.frame), targets[k]);
    }
    [[nodiscard]] RigidTransform start(std::size_t k) const {
        return perturbed_start(path(k, 0), targets[k], 2, 1 + k);
    }

    std::vector<Phantom> bones;
    std::vector<Volume> volumes;
    std::vector<std::vector<Eigen::Vector3d>> targets;
    std::vector<View> geometry = test::biplane_views(128, 220);
    TrackOptions options;
    double shift_mm = -30;
    BackendChoice choice = create_backend("cpu");
};

/// Both followed, in company.
struct Followed {
    explicit Followed(Pair& pair)
        : scene(pair), company(std::vector{&pair.volumes[0], &pair.volumes[1]}, pair.options, *pair.choice.backend) {
        for (std::size_t k = 0; k < 2; ++k) {
            trackers.emplace_back(pair.volumes[k], pair.start(k), pair.options, *pair.choice.backend);
        }
    }
    std::vector<TrackFrame> feed(int frame) {
        const std::vector<View> views = scene.xrays(frame);
        std::vector<Expectation> expected;
        for (std::size_t k = 0; k < 2; ++k) {
            expected.push_back({prospects[k].whereabouts(), trackers[k].predicted(frame)});
        }
        company.meet(views, expected, {});
        std::vector<TrackFrame> found;
        for (std::size_t k = 0; k < 2; ++k) {
            found.push_back(trackers[k].feed(
                frame, [&](std::optional<int> coarser_by) { return company.remainder(views, k, coarser_by); }));
            prospects[k].remember(found[k]);
        }
        return found;
    }
    void recall(const std::vector<TrackFrame>& found) {
        for (std::size_t k = 0; k < 2; ++k) {
            trackers[k].recall(found[k]);
            prospects[k].remember(found[k]);
        }
    }

    Pair& scene;
    Company company;
    std::deque<Tracker> trackers;
    std::vector<Prospect> prospects = std::vector<Prospect>(2);
};

}  // namespace

TEST(Company, BonesOverEachOtherAreFoundTogetherAndNotAlone) {
    Pair pair;
    Followed together(pair);
    double sum_mm = 0, sum_alone_mm = 0;
    std::deque<Tracker> alone;
    for (std::size_t k = 0; k < 2; ++k) {
        alone.emplace_back(pair.volumes[k], pair.start(k), pair.options, *pair.choice.backend);
    }
    int quick = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
        const std::vector<TrackFrame> found = together.feed(frame);
        for (std::size_t k = 0; k < 2; ++k) {
            EXPECT_EQ(found[k].status, TrackStatus::ok) << k << " " << frame;
            EXPECT_LT(pair.mtre_mm(k, found[k]), kInCompany_mm) << k << " " << frame;
            quick += found[k].quick;
            sum_mm += pair.mtre_mm(k, found[k]);
            sum_alone_mm += pair.mtre_mm(k, alone[k].feed(frame, pair.xrays(frame)));
        }
    }
    EXPECT_GT(sum_alone_mm, kAstray * sum_mm);
    EXPECT_GT(quick, 0) << "each is followed as quickly as alone";
}

TEST(Company, GoesOnWithTheSameBits) {
    Pair pair;
    Followed once(pair), again(pair);
    std::vector<TrackFrame> last;
    for (int frame = 0; frame < 4; ++frame) {
        last = once.feed(frame);
        if (frame < 3) again.recall(last);
    }
    const std::vector<TrackFrame> found = again.feed(3);
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(found[k].world_from_ct.rotation, last[k].world_from_ct.rotation);
        EXPECT_EQ(found[k].world_from_ct.translation_mm, last[k].world_from_ct.translation_mm);
    }
}

TEST(Company, ThoseFarFromEachOtherAreLeftAsTheyAre) {
    Pair pair;
    pair.shift_mm = 70;
    const std::vector<View> views = pair.xrays(0);
    Company company(std::vector{&pair.volumes[0], &pair.volumes[1]}, pair.options, *pair.choice.backend);
    const std::vector<Expectation> expected{{Whereabouts::start, pair.path(0, 0)},
                                            {Whereabouts::start, pair.path(1, 0)}};
    company.meet(views, expected, {});
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(company.remainder(views, k)[0].image.pixels, views[0].image.pixels);
    }
}

/// Root mean square of a view's pixels, or of how two differ.
double rms(const Image& image, const Image& less) {
    double sum = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) sum += std::pow(image.pixels[i] - less.pixels[i], 2);
    return std::sqrt(sum / static_cast<double>(image.pixels.size()));
}

/// `left` had what is hidden been drawn a pixel farther right.
View moved_by_one(View left, const View& whole) {
    const View before = left;
    for (int y = 0; y < left.image.height; ++y) {
        for (int x = 1; x < left.image.width; ++x) {
            left.image(x, y) = whole.image(x, y) - (whole.image(x - 1, y) - before.image(x - 1, y));
        }
    }
    return left;
}

TEST(Company, OthersAreDrawnAsFinelyAsTheirNeighbourIsLookedAt) {
    Pair pair;
    const std::vector<View> views = pair.xrays(0);
    Company company(std::vector{&pair.volumes[0], &pair.volumes[1]}, pair.options, *pair.choice.backend);
    company.meet(views,
                 std::vector<Expectation>{{Whereabouts::near, pair.path(0, 0)}, {Whereabouts::near, pair.path(1, 0)}},
                 {});
    const std::vector<View> in_full = company.remainder(views, 0), coarse = company.remainder(views, 0, 1);
    for (std::size_t v = 0; v < views.size(); ++v) {
        EXPECT_EQ(coarse[v].geometry.camera.size_px, views[v].geometry.camera.size_px);
        EXPECT_NE(coarse[v].image.pixels, in_full[v].image.pixels) << "coarser voxels and pixels";
        const Image seen = halved(coarse[v], 1).image, same = halved(in_full[v], 1).image;
        const double hidden = rms(halved(views[v], 1).image, same);
        EXPECT_LT(rms(seen, same), kCoarser * hidden) << v;
        EXPECT_GT(rms(halved(moved_by_one(in_full[v], views[v]), 1).image, same), kCoarser * hidden) << "half a pixel";
    }
}

TEST(Company, ALostOneHidesNothingAndSeesWhatTheOtherLeaves) {
    Pair pair;
    const std::vector<View> views = pair.xrays(0);
    Company company(std::vector{&pair.volumes[0], &pair.volumes[1]}, pair.options, *pair.choice.backend);
    for (const Whereabouts known : {Whereabouts::near, Whereabouts::settled}) {
        company.meet(views, std::vector<Expectation>{{known, pair.path(0, 0)}, {}}, {});
        EXPECT_EQ(company.remainder(views, 0)[0].image.pixels, views[0].image.pixels);
        EXPECT_NE(company.remainder(views, 1)[0].image.pixels, views[0].image.pixels);
    }
}

TEST(Company, NeedsGaussNewton) {
    Pair pair;
    EXPECT_TRUE(Company::is_possible(pair.options, *pair.choice.backend));
    pair.options.registration.method = Method::bobyqa;
    EXPECT_FALSE(Company::is_possible(pair.options, *pair.choice.backend));
}

}  // namespace raylign::detail
