#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/io/images/raster.h"
#include "io_files.h"
#include "raylign/io/frame_files.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class FrameFiles : public IoTest {
protected:
    void frame(const std::string& name, float value, int pages = 1) const {
        detail::Raster raster;
        raster.format = detail::FileFormat::tiff;
        raster.size = {4, 3};
        if (pages > 1) raster.size.push_back(pages);
        raster.spacing_mm.assign(raster.size.size(), 1);
        raster.origin_mm.assign(raster.size.size(), 0);
        raster.direction = Eigen::MatrixXd::Identity(raster.size.size(), raster.size.size());
        raster.type = detail::PixelType::f32;
        for (int page = 0; page < pages; ++page) {
            for (int i = 0; i < 12; ++i) {
                const float pixel = value + 100.F * static_cast<float>(page);
                const auto* bytes = reinterpret_cast<const std::byte*>(&pixel);
                raster.bytes.insert(raster.bytes.end(), bytes, bytes + sizeof pixel);
            }
        }
        detail::write_raster(at(name), raster);
    }
    [[nodiscard]] std::vector<int> numbers(const std::string& pattern) const {
        std::vector<int> list;
        for (const FrameFile& found : list_frames(at(pattern))) list.push_back(found.number);
        return list;
    }
};

TEST_F(FrameFiles, PatternsListNumbersInTheirNaturalOrder) {
    for (const char* name :
         {"cam1.2.tif", "cam1.10.tif", "cam1.0001.tif", "cam2.0003.tif", "cam1.x.tif", ".cam1.7.tif"}) {
        frame(name, 1);
    }
    EXPECT_THAT(numbers("cam1.%d.tif"), ElementsAre(1, 2, 10));
    EXPECT_THAT(numbers("cam1.%04d.tif"), ElementsAre(1)) << "four digits at least";
    EXPECT_THAT(numbers("cam?.000*.tif"), ElementsAre(1, 3));
    EXPECT_EQ(list_frames(at("cam1.%d.tif"))[2].file, at("cam1.10.tif"));
    std::filesystem::remove(at("cam1.x.tif"));
    EXPECT_THAT(numbers("cam1.*.tif"), ElementsAre(1, 2, 10));
    std::filesystem::create_directory(at("sub"));
    frame("sub/a7.tif", 1);
    frame("sub/b11.tif", 1);
    EXPECT_THAT(numbers("sub"), ElementsAre(7, 11)) << "a folder is all of its files";
    frame("50%0d%%.12.tif", 1);
    EXPECT_THAT(numbers("50%0d%%.%2d.tif"), ElementsAre(12)) << "other percent signs are as they stand";
}

TEST_F(FrameFiles, AFileWithSeveralFramesIsASequence) {
    frame("stack.tif", 5, 3);
    frame("single.tif", 9);
    const auto frames = list_frames(at("stack.tif"));
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(frames[2].number, 3);
    FrameReader reader;
    EXPECT_EQ(reader.read(frames[1]).image(3, 2), 105);
    EXPECT_EQ(reader.read(frames[0]).image(0, 0), 5);
    EXPECT_EQ(reader.read(list_frames(at("single.tif"))[0]).image(1, 1), 9);
    EXPECT_EQ(reader.read(frames[2]).image(0, 0), 205) << "back to the file that was open before";
    EXPECT_EQ(xray_size_px(at("stack.tif")), Eigen::Vector2i(4, 3));
}

TEST_F(FrameFiles, AListIsNumberedAsItStands) {
    frame("b.tif", 1);
    frame("a.tif", 2);
    const auto frames = list_frames(std::vector<std::filesystem::path>{at("b.tif"), at("a.tif")});
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[0].file, at("b.tif"));
    EXPECT_EQ(frames[1].number, 2);
    EXPECT_EQ(list_frames(std::vector<std::filesystem::path>{at("b.tif"), at("none.tif")}).size(), 2u)
        << "a gap, when its turn comes";
    const auto list = [&] { (void)list_frames(std::vector<std::filesystem::path>{at("none.tif"), at("nor.tif")}); };
    EXPECT_THAT(error_of(list), HasSubstr("none.tif"));
    EXPECT_THAT(error_of([] { (void)list_frames(std::vector<std::filesystem::path>()); }), HasSubstr("at least one"));
}

TEST_F(FrameFiles, FaultsAreNamed) {
    frame("cam1.1.tif", 1);
    frame("cam1.001.tif", 1);
    frame("take2_cam1.tif", 1);
    frame("take3_cam1.tif", 1);
    frame("none.tif", 1);
    const auto message = [&](const std::string& pattern) { return error_of([&] { (void)list_frames(at(pattern)); }); };
    EXPECT_THAT(message("cam1.%d.tif"),
                AllOf(HasSubstr("cam1.1.tif"), HasSubstr("cam1.001.tif"), HasSubstr("number 1")));
    EXPECT_THAT(message("take*_cam1.tif"), AllOf(HasSubstr("number 1"), HasSubstr("%d")));
    EXPECT_THAT(message("no*.tif"), HasSubstr("no number"));
    EXPECT_THAT(message("cam7.%d.tif"), HasSubstr("no file fits"));
    EXPECT_THAT(message("nowhere/cam.%d.tif"), HasSubstr("nowhere"));
    EXPECT_THAT(message("cam7.tif"), HasSubstr("cam7.tif"));
    EXPECT_THAT(message("cam%d.123456789012345678901234567890.tif"), HasSubstr("no file fits"));
    frame("huge99999999999.tif", 1);
    EXPECT_THAT(message("huge%d.tif"), HasSubstr("no file fits"));
    FrameReader reader;
    frame("stack.tif", 5, 2);
    EXPECT_THAT(error_of([&] { (void)reader.read({9, at("stack.tif"), 9}); }), HasSubstr("[1, 2]"));
}

TEST_F(FrameFiles, WhatIsNoFileIsAFrameThatCannotBeRead) {
    frame("cam1.1.tif", 1);
    ASSERT_EQ(::mkfifo(at("cam1.2.tif").c_str(), 0600), 0);
    std::filesystem::create_symlink("nowhere", at("cam1.3.tif"));
    std::filesystem::create_directory(at("cam1.4.tif"));
    const auto frames = list_frames(at("cam1.%d.tif"));
    ASSERT_EQ(frames.size(), 3u);
    FrameReader reader;
    EXPECT_THAT(error_of([&] { (void)reader.read(frames[1]); }), AllOf(HasSubstr("cam1.2.tif"), HasSubstr("FIFO")));
    EXPECT_THAT(error_of([&] { (void)reader.read(frames[2]); }), HasSubstr("cam1.3.tif does not exist"));
    EXPECT_EQ(reader.read(frames[0]).image(0, 0), 1);
}

TEST_F(FrameFiles, AFileThatDoesNotReadIsNotTriedForEachOfItsFrames) {
    write("run.dcm", "no DICOM");
    FrameReader reader;
    const std::string first = error_of([&] { (void)reader.read({1, at("run.dcm"), 1}); });
    EXPECT_THAT(first, HasSubstr("run.dcm"));
    frame("stack.tif", 5, 2);
    std::filesystem::rename(at("stack.tif"), at("run.dcm"));
    EXPECT_EQ(error_of([&] { (void)reader.read({2, at("run.dcm"), 2}); }), first);
}

}  // namespace
}  // namespace raylign::detail::test
