#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/images/raster.h"
#include "io_files.h"
#include "raylign/io/frames.h"
#include "views_text.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Two views of 8 x 6 pixels whose frames are 8-bit images: bone dark (transmission) with air around.
class FrameViews : public IoTest {
protected:
    void SetUp() override {
        IoTest::SetUp();
        for (int number = 1; number <= 4; ++number) {
            frame("ap." + std::to_string(number) + ".png", 8, 6, number);
            frame("lat." + std::to_string(number) + ".png", 8, 6, number + 40);
        }
    }
    void frame(const std::string& name, int width, int height, int value) const {
        detail::Raster raster;
        raster.format = detail::FileFormat::png;
        raster.size = {width, height};
        raster.spacing_mm = {1, 1};
        raster.origin_mm = {0, 0};
        raster.direction = Eigen::MatrixXd::Identity(2, 2);
        raster.type = detail::PixelType::u8;
        for (int i = 0; i < width * height; ++i) {
            raster.bytes.push_back(std::byte(value < 0 ? 70 : i % width < 3 ? 200 : 20 + value + i % height));
        }
        detail::write_raster(at(name), raster);
    }
    [[nodiscard]] ViewsFile views(const std::string& more_lat = R"("frames": "lat.%d.png",)",
                                  const std::vector<std::string>& options = {}) const {
        const std::string ap = replaced(kCameraView, "\"camera\"", "\"frames\": \"ap.%d.png\", \"camera\"");
        const std::string lat =
            replaced(replaced(kCameraView, "\"AP\"", "\"LAT\""), "\"camera\"", more_lat + " \"camera\"");
        write("views.json", views_json(ap + ", " + lat));
        const std::vector<std::string> files{at("views.json").string()};
        return read_views(files, ViewsReadOptions{.images = ReadImages::frames, .auto_mask = false, .frames = options});
    }
};

TEST_F(FrameViews, AnInstantIsWhatReadingItsImagesAloneGives) {
    InstantReader reader(views());
    const auto frames = pair_frames(views(), {});
    ASSERT_EQ(frames.size(), 4u);
    const Instant instant = reader.read(frames[2]);
    ASSERT_EQ(instant.gap, "");
    ASSERT_EQ(instant.views.size(), 2u);
    const std::string single = replaced(kCameraView, "\"camera\"", "\"image\": \"ap.3.png\", \"camera\"");
    write("single.json", views_json(single));
    const ViewsFile alone = read_views(at("single.json"), ReadImages::required);
    EXPECT_EQ(instant.views[0].image.pixels, alone.views[0].image.pixels);
    EXPECT_EQ(instant.views[0].geometry.camera.intrinsics_px, alone.views[0].geometry.camera.intrinsics_px);
    EXPECT_THAT(reader.notes(), testing::Contains(HasSubstr("polarity")));
    const std::size_t notes = reader.notes().size();
    (void)reader.read(frames[0]);
    EXPECT_EQ(reader.notes().size(), notes) << "decisions are noted once";
}

TEST_F(FrameViews, RangesAndStepsChooseByNumber) {
    const auto chosen = [&](const FrameRange& range) {
        std::vector<int> numbers;
        for (const FrameSet& set : pair_frames(views(), range)) numbers.push_back(set.number);
        return numbers;
    };
    EXPECT_EQ(chosen({2, 3, 1}), (std::vector{2, 3}));
    EXPECT_EQ(chosen({{}, {}, 2}), (std::vector{1, 3}));
    EXPECT_EQ(chosen({2, {}, 2}), (std::vector{2, 4}));
    EXPECT_THAT(error_of([&] { (void)chosen({3, 2, 1}); }), HasSubstr("first frame"));
    EXPECT_THAT(error_of([&] { (void)chosen({{}, {}, 0}); }), HasSubstr("step"));
    EXPECT_THAT(error_of([&] { (void)chosen({9, {}, 1}); }), AllOf(HasSubstr("AP has 1 to 4"), HasSubstr("LAT")));
}

TEST_F(FrameViews, MissingEmptyAndUnreadableFramesAreGaps) {
    std::filesystem::remove(at("lat.2.png"));
    frame("ap.3.png", 8, 6, -1);
    write("lat.4.png", "not an image");
    const ViewsFile read = views();
    const auto frames = pair_frames(read, {});
    ASSERT_EQ(frames.size(), 4u);
    check_frame_sizes(read, frames);
    InstantReader reader(read);
    EXPECT_EQ(reader.read(frames[0]).gap, "");
    EXPECT_THAT(reader.read(frames[1]).gap, HasSubstr("LAT has no frame 2"));
    EXPECT_THAT(reader.read(frames[2]).gap, AllOf(HasSubstr("AP"), HasSubstr("empty")));
    EXPECT_THAT(reader.read(frames[3]).gap, AllOf(HasSubstr("LAT"), HasSubstr("lat.4.png")));
}

TEST_F(FrameViews, ANumberThatNoViewHasIsAGap) {
    for (const char* name : {"ap.3.png", "lat.3.png"}) std::filesystem::remove(at(name));
    const ViewsFile read = views();
    const auto frames = pair_frames(read, {});
    ASSERT_EQ(frames.size(), 4u);
    check_frame_sizes(read, frames);
    EXPECT_EQ(frames[2].number, 3);
    EXPECT_THAT(InstantReader(read).read(frames[2]).gap, HasSubstr("AP has no frame 3"));
    EXPECT_EQ(pair_frames(read, {3, 4, 1}).size(), 2u) << "also as the first";
}

TEST_F(FrameViews, ASequenceOfOneViewHasGapsInItsOwnSteps) {
    const std::string ap = replaced(kCameraView, "\"camera\"", "\"frames\": \"s.*.png\", \"camera\"");
    write("one.json", views_json(ap));
    const auto numbers = [&](const std::vector<int>& there) {
        for (const int number : there) frame("s." + std::to_string(number) + ".png", 8, 6, 1);
        const std::vector<std::string> files{at("one.json").string()};
        const ViewsFile read = read_views(files, ViewsReadOptions{.images = ReadImages::frames});
        std::vector<int> result;
        for (const FrameSet& set : pair_frames(read, {})) result.push_back(set.number);
        for (const int number : there) std::filesystem::remove(at("s." + std::to_string(number) + ".png"));
        return result;
    };
    EXPECT_EQ(numbers({1, 2, 4}), (std::vector{1, 2, 3, 4}));
    EXPECT_EQ(numbers({10, 20, 40, 50}), (std::vector{10, 20, 30, 40, 50}));
    EXPECT_EQ(numbers({5}), (std::vector{5}));
    EXPECT_EQ(numbers({7, 1003, 2001}), (std::vector{7, 1003, 2001})) << "times, not counts";
}

TEST_F(FrameViews, ADamagedFirstFrameIsAGapToo) {
    write("ap.1.png", "not an image");
    const ViewsFile read = views();
    InstantReader reader(read);
    const auto frames = pair_frames(read, {});
    EXPECT_THAT(reader.read(frames[0]).gap, AllOf(HasSubstr("AP"), HasSubstr("ap.1.png")));
    EXPECT_EQ(reader.read(frames[1]).gap, "");
    for (int number = 2; number <= 4; ++number) write("ap." + std::to_string(number) + ".png", "nor these");
    EXPECT_THAT(error_of([&] { (void)views(); }), HasSubstr("ap.1.png"));
}

TEST_F(FrameViews, AnotherSizeIsAnErrorBeforehandAndAGapLater) {
    frame("lat.3.png", 8, 7, 1);
    const ViewsFile read = views();
    const auto frames = pair_frames(read, {});
    EXPECT_THAT(error_of([&] { check_frame_sizes(read, frames); }), AllOf(HasSubstr("lat.3.png"), HasSubstr("8 x 6")));
    InstantReader reader(read);
    EXPECT_THAT(reader.read(frames[2]).gap, AllOf(HasSubstr("lat.3.png"), HasSubstr("8 x 6")));
    EXPECT_EQ(reader.read(frames[3]).gap, "");
}

TEST_F(FrameViews, NoCommonNumbersAreRefused) {
    for (int number = 1; number <= 4; ++number) {
        std::filesystem::rename(at("lat." + std::to_string(number) + ".png"),
                                at("lat." + std::to_string(number + 100) + ".png"));
    }
    EXPECT_THAT(error_of([&] { (void)pair_frames(views(), {}); }),
                AllOf(HasSubstr("AP has 1 to 4"), HasSubstr("LAT has 101 to 104")));
}

TEST_F(FrameViews, FramesComeByOptionListOrImage) {
    const auto count = [](const ViewsFile& read) { return read.origins[1].frames.size(); };
    EXPECT_EQ(count(views("", {"LAT=" + at("lat.%d.png").string()})), 4u);
    EXPECT_EQ(count(views(R"("frames": ["lat.2.png", "lat.1.png"],)")), 2u);
    EXPECT_EQ(count(views(R"("image": "lat.*.png",)")), 4u);
    EXPECT_EQ(count(views(R"("image": "lat.3.png",)")), 1u);
    EXPECT_EQ(count(views(R"("frames": "lat.1.png",)", {"LAT=" + at("lat.*.png").string()})), 4u) << "options win";
    EXPECT_THAT(error_of([&] { (void)views(""); }), AllOf(HasSubstr("LAT"), HasSubstr("--frames LAT=PATTERN")));
    EXPECT_THAT(error_of([&] { (void)views("", {"LATERAL=x.%d.png"}); }),
                AllOf(HasSubstr("LATERAL"), HasSubstr("AP, LAT")));
    const std::string all = "LAT=" + at("lat.%d.png").string();
    EXPECT_THAT(error_of([&] { (void)views("", {all, all}); }), HasSubstr("twice"));
    EXPECT_THAT(error_of([&] { (void)views("", {all, "LAT"}); }), HasSubstr("VIEW=PATTERN"));
    EXPECT_THAT(error_of([&] { (void)views(R"("frames": [],)"); }), HasSubstr("at least one"));
    EXPECT_THAT(error_of([&] { (void)views(R"("frames": 3,)"); }), HasSubstr("frames"));
}

TEST_F(FrameViews, ThePolarityOfTheFirstFrameHolds) {
    const ViewsFile read = views();
    InstantReader reader(read);
    const auto frames = pair_frames(read, {});
    const Instant first = reader.read(frames[0]);
    // A frame that would be settled the other way round: bright inside, dark around.
    detail::Raster raster;
    raster.format = detail::FileFormat::png;
    raster.size = {8, 6};
    raster.spacing_mm = {1, 1};
    raster.origin_mm = {0, 0};
    raster.direction = Eigen::MatrixXd::Identity(2, 2);
    raster.type = detail::PixelType::u8;
    for (int i = 0; i < 48; ++i) raster.bytes.push_back(std::byte(i % 8 < 5 ? 10 : 200));
    detail::write_raster(at("ap.2.png"), raster);
    const Instant second = reader.read(frames[1]);
    EXPECT_GT(first.views[0].image(5, 2), first.views[0].image(0, 2)) << "transmission: dark pixels are dense";
    EXPECT_GT(second.views[0].image(0, 2), second.views[0].image(7, 2));
}

}  // namespace
}  // namespace raylign::detail::test
