#include <gmock/gmock.h>

#include "dicom_files.h"
#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::ct_slice;
using test::DicomBuilder;
using test::enhanced_ct;
using test::error_of;
using test::sequence_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint32_t kClass = 0x00080016, kModality = 0x00080060, kSlope = 0x00281053, kIntercept = 0x00281052,
                        kPhotometric = 0x00280004, kPadding = 0x00280120, kPaddingLimit = 0x00280121;

float water(double hu) { return static_cast<float>(0.0193 * (1 + hu / 1000)); }

class DicomCt : public test::IoTest {
protected:
    /// A good series of three slices of 0, 100 and 200 HU, the middle one changed.
    [[nodiscard]] VolumeFile read_with(const DicomBuilder& middle) const {
        (void)write("a", ct_slice(0, 0).bytes());
        (void)write("b", middle.bytes());
        (void)write("c", ct_slice(4, 200).bytes());
        return read_volume(folder_);
    }
    [[nodiscard]] std::string problem_of(const DicomBuilder& middle) const {
        return error_of([&] { (void)read_with(middle); });
    }
    [[nodiscard]] VolumeFile read_file(const DicomBuilder& file) const {
        return read_volume(write("file.dcm", file.bytes()));
    }
};

TEST_F(DicomCt, EachSliceHasItsOwnSlopeAndIntercept) {
    DicomBuilder middle = ct_slice(2);
    middle.set(kSlope, "DS", "2").set(kIntercept, "DS", "-500");
    middle.pixels.assign(6, 300);
    const VolumeFile file = read_with(middle);
    EXPECT_FLOAT_EQ(file.volume(1, 1, 0), water(0));
    EXPECT_FLOAT_EQ(file.volume(1, 1, 1), water(100));
    EXPECT_FLOAT_EQ(file.volume(1, 1, 2), water(200));
    EXPECT_THAT(file.notes, Contains(HasSubstr("each slice has its own")));
}

TEST_F(DicomCt, SlopeAndInterceptThatAreNoneAreRefused) {
    const auto with = [](std::uint32_t tag, const std::string& value) {
        return ct_slice(2, 100).set(tag, "DS", value);
    };
    for (const char* value : {"abc", "NaN", "1\\2", "inf"}) {
        EXPECT_THAT(problem_of(with(kSlope, value)),
                    AllOf(HasSubstr("RescaleSlope (0028,1053) = " + std::string(value)), HasSubstr("/b"),
                          HasSubstr("one finite number")));
        EXPECT_THAT(problem_of(with(kIntercept, value)), HasSubstr("RescaleIntercept (0028,1052) = "));
    }
    EXPECT_THAT(problem_of(with(kSlope, "0")), AllOf(HasSubstr("= 0 in "), HasSubstr("/b"), HasSubstr("other than 0")));
    EXPECT_THAT(problem_of(ct_slice(2).erase(kSlope)), AllOf(HasSubstr("RescaleSlope (0028,1053) is missing")));
    EXPECT_THAT(problem_of(ct_slice(2).erase(kSlope).erase(kIntercept)),
                AllOf(HasSubstr("= missing"), HasSubstr("/b"), HasSubstr("1 and -1024")));
}

TEST_F(DicomCt, SlopesMissingEverywhereAreNoted) {
    for (int z : {0, 1}) {
        DicomBuilder slice = ct_slice(z).erase(kSlope).erase(kIntercept).erase(0x00281054);
        slice.pixels.assign(6, 40);
        (void)write(std::to_string(z), slice.bytes());
    }
    const VolumeFile file = read_volume(folder_);
    EXPECT_FLOAT_EQ(file.volume(0, 0, 0), water(40));
    EXPECT_THAT(file.notes, Contains(HasSubstr("stored values are taken as HU")));
}

TEST_F(DicomCt, SlicesThatAreStoredInAnotherWayAreRefused) {
    EXPECT_THAT(problem_of(ct_slice(2).us(0x00280101, 13).us(0x00280102, 12)),
                AllOf(HasSubstr("BitsStored (0028,0101) = 13"), HasSubstr("/b"), HasSubstr("/a, 12")));
    EXPECT_THAT(problem_of(ct_slice(2).us(0x00280102, 12)), HasSubstr("HighBit (0028,0102) = 12"));
    EXPECT_THAT(problem_of(ct_slice(2).us(0x00280103, 1)), HasSubstr("PixelRepresentation (0028,0103) = 1"));
    EXPECT_THAT(problem_of(ct_slice(2).set(kPhotometric, "CS", "MONOCHROME1")), HasSubstr("= MONOCHROME1"));
    EXPECT_THAT(problem_of(ct_slice(2).us(0x00280100, 8).us(0x00280101, 8).us(0x00280102, 7)),
                HasSubstr("BitsAllocated (0028,0100) = 8"));
    EXPECT_THAT(problem_of(ct_slice(2).us(0x00280010, 3).us(0x00280011, 2)),
                AllOf(HasSubstr("2 x 3"), HasSubstr("3 x 2")));
    EXPECT_THAT(problem_of(ct_slice(2).set(0x00280030, "DS", "0.75\\0.501")),
                AllOf(HasSubstr("0.75 x 0.501 mm"), HasSubstr("0.75 x 0.5 mm")));
    EXPECT_THAT(problem_of(ct_slice(2).set(0x00281054, "LO", "Z_EFF")), HasSubstr("RescaleType (0028,1054) = Z_EFF"));
    EXPECT_THAT(problem_of(ct_slice(2).set(0x00200052, "UI", "1.5")), HasSubstr("FrameOfReferenceUID"));
}

TEST_F(DicomCt, StorageThatNoImageHasIsRefused) {
    const auto us = [](std::uint32_t tag, std::uint16_t value) { return ct_slice(2).us(tag, value); };
    EXPECT_THAT(problem_of(us(0x00280100, 12)), AllOf(HasSubstr("BitsAllocated (0028,0100) = 12"), HasSubstr("8, 16")));
    EXPECT_THAT(problem_of(us(0x00280101, 17)), AllOf(HasSubstr("BitsStored (0028,0101) = 17"), HasSubstr("[1, ")));
    EXPECT_THAT(problem_of(us(0x00280102, 10)), AllOf(HasSubstr("HighBit (0028,0102) = 10"), HasSubstr("11")));
    EXPECT_THAT(problem_of(us(0x00280103, 2)), HasSubstr("PixelRepresentation (0028,0103) = 2"));
    EXPECT_THAT(problem_of(us(0x00280010, 0)), HasSubstr("Rows (0028,0010) = 0"));
    EXPECT_THAT(problem_of(ct_slice(2).set(kPhotometric, "CS", "MONOCHROM2")),
                AllOf(HasSubstr("PhotometricInterpretation (0028,0004) = MONOCHROM2"), HasSubstr("MONOCHROME1")));
    DicomBuilder loud = ct_slice(2);
    loud.pixels[4] = 5000;
    EXPECT_THAT(problem_of(loud), AllOf(HasSubstr("stored value of pixel 4 = 5000"), HasSubstr("[0, 4095]")));
}

TEST_F(DicomCt, SignedValuesAreReadWithAndWithoutTheirSignExtended) {
    DicomBuilder file = enhanced_ct({0, 1}, {0, 0});
    DicomBuilder none, transformation;
    transformation.set(kSlope, "DS", "1").set(kIntercept, "DS", "0");
    DicomBuilder orientation, measures, shared;
    orientation.set(0x00200037, "DS", "1\\0\\0\\0\\1\\0");
    measures.set(0x00280030, "DS", "0.75\\0.5");
    shared.set(0x00209116, "SQ", sequence_of({orientation})).set(0x00289110, "SQ", sequence_of({measures}));
    shared.set(0x00289145, "SQ", sequence_of({transformation}));
    file.us(0x00280103, 1).set(0x52009229, "SQ", sequence_of({shared}));
    file.pixels.assign(12, 0xff9c);               // -100, its sign over all 16 bits
    std::fill_n(file.pixels.begin(), 6, 0x0f9c);  // and over 12
    const Volume volume = read_file(file).volume;
    EXPECT_FLOAT_EQ(volume(0, 0, 0), water(-100));
    EXPECT_FLOAT_EQ(volume(0, 0, 1), water(-100));
}

TEST_F(DicomCt, PaddingIsAirAndCounted) {
    DicomBuilder middle = ct_slice(2, 100);
    middle.us(kPadding, 3000).us(kPaddingLimit, 3010);
    middle.pixels[0] = 3000;
    middle.pixels[5] = 3007;
    const VolumeFile file = read_with(middle);
    EXPECT_EQ(file.volume(0, 0, 1), 0);
    EXPECT_EQ(file.volume(2, 1, 1), 0);
    EXPECT_FLOAT_EQ(file.volume(1, 0, 1), water(100));
    EXPECT_THAT(file.notes, Contains(HasSubstr("2 voxels have PixelPaddingValue (0028,0120)")));
}

TEST_F(DicomCt, OtherImagesAreNamedAndRefused) {
    const std::string storage = "1.2.840.10008.5.1.4.1.1.";
    for (const auto& [id, name] : std::vector<std::pair<const char*, const char*>>{
             {"4", "MR"}, {"128", "PET"}, {"6.1", "ultrasound"}, {"7", "secondary capture"}, {"481.2", "RT dose"}}) {
        EXPECT_THAT(problem_of(ct_slice(2).set(kClass, "UI", storage + id)),
                    AllOf(HasSubstr("kind of image = " + std::string(name)), HasSubstr("/b"), HasSubstr("must be CT")));
    }
    EXPECT_THAT(problem_of(ct_slice(2).erase(kClass).set(kModality, "CS", "MR")), HasSubstr("kind of image = MR"));
    std::filesystem::remove(at("b"));
    std::filesystem::remove(at("c"));
    EXPECT_THAT(error_of([&] { (void)read_xray(at("a")); }),
                AllOf(HasSubstr("kind of image = CT"), HasSubstr("must be an X-ray")));
}

TEST_F(DicomCt, LocalizersAreLeftOutAndNoted) {
    for (int z : {0, 1, 2}) (void)write(std::to_string(z), ct_slice(z).bytes());
    DicomBuilder scout = ct_slice(50).set(0x00080008, "CS", "ORIGINAL\\PRIMARY\\LOCALIZER");
    (void)write("scout", scout.bytes());
    const VolumeFile file = read_volume(folder_);
    EXPECT_EQ(file.volume.grid.size.z(), 3);
    EXPECT_THAT(file.notes, Contains(HasSubstr("1 localizers")));
    EXPECT_THAT(error_of([&] { (void)read_volume(at("scout")); }), HasSubstr("nothing but localizers"));
}

TEST_F(DicomCt, TheOnlyCtOfAFolderIsTaken) {
    for (int z : {0, 1}) (void)write(std::to_string(z), ct_slice(z).bytes());
    DicomBuilder report = ct_slice(0).set(kClass, "UI", "1.2.840.10008.5.1.4.1.1.7").set(0x0020000e, "UI", "1.9");
    (void)write("report", report.bytes());
    const VolumeFile file = read_volume(folder_);
    EXPECT_EQ(file.volume.grid.size.z(), 2);
    EXPECT_THAT(file.notes, Contains(HasSubstr("1 other series")));
}

TEST_F(DicomCt, FoldersWithinAreNamed) {
    std::filesystem::create_directories(at("thin"));
    for (int z : {0, 1}) (void)write("thin/" + std::to_string(z), ct_slice(z).bytes());
    EXPECT_THAT(error_of([&] { (void)read_volume(folder_); }),
                AllOf(HasSubstr("no DICOM image"), HasSubstr("/thin: 2 DICOM files")));
}

TEST_F(DicomCt, OneSliceOfASeriesSaysWhichFolderToGive) {
    const auto path = write("one.dcm", ct_slice(0).bytes());
    EXPECT_THAT(error_of([&] { (void)read_volume(path); }), AllOf(HasSubstr("give its folder, " + folder_.string())));
}

TEST_F(DicomCt, FramesThatRunDownAreSorted) {
    const VolumeFile file = read_file(enhanced_ct({30, 20, 10}, {300, 200, 100}));
    EXPECT_LT((file.volume.grid.origin_mm - Eigen::Vector3d(10, 20, 10)).norm(), 1e-9);
    EXPECT_LT((file.volume.grid.spacing_mm - Eigen::Vector3d(0.5, 0.75, 10)).norm(), 1e-9);
    for (int z : {0, 1, 2}) EXPECT_FLOAT_EQ(file.volume(1, 1, z), water(100 * (z + 1)));
    EXPECT_EQ(file.files.size(), 1U);
}

TEST_F(DicomCt, FramesHaveTheirOwnSlopes) {
    DicomBuilder file = enhanced_ct({0, 1}, {0, 0});
    std::vector<DicomBuilder> frames;
    for (int i : {0, 1}) {
        DicomBuilder position, transformation, frame;
        position.set(0x00200032, "DS", "0\\0\\" + std::to_string(i));
        transformation.set(kSlope, "DS", i == 0 ? "1" : "0.5").set(kIntercept, "DS", "-1000");
        frame.set(0x00209113, "SQ", sequence_of({position})).set(0x00289145, "SQ", sequence_of({transformation}));
        frames.push_back(frame);
    }
    file.set(0x52009230, "SQ", sequence_of(frames));
    file.pixels.assign(12, 2001);
    const Volume volume = read_file(file).volume;
    EXPECT_FLOAT_EQ(volume(0, 0, 0), water(1001));
    EXPECT_FLOAT_EQ(volume(0, 0, 1), water(0.5));
}

TEST_F(DicomCt, StacksOfOneFileAreListedAndChosen) {
    DicomBuilder file = enhanced_ct({0, 1, 0, 1}, {0, 10, 20, 30});
    std::vector<DicomBuilder> frames;
    for (int i = 0; i < 4; ++i) {
        DicomBuilder position, content, frame;
        position.set(0x00200032, "DS", "0\\0\\" + std::to_string(i % 2));
        content.set(0x00209056, "SH", i < 2 ? "1" : "2");
        frame.set(0x00209111, "SQ", sequence_of({content})).set(0x00209113, "SQ", sequence_of({position}));
        frames.push_back(frame);
    }
    file.set(0x52009230, "SQ", sequence_of(frames));
    EXPECT_THAT(error_of([&] { (void)read_file(file); }), AllOf(HasSubstr("--series"), HasSubstr("stack 1"),
                                                                HasSubstr("stack 2"), HasSubstr("2 frames of 1 file")));
    EXPECT_FLOAT_EQ(read_volume(at("file.dcm"), {.series = "2"}).volume(0, 0, 1), water(30));
}

TEST_F(DicomCt, FramesOfUnevenGapsOrWithoutPlacesAreRefused) {
    EXPECT_THAT(error_of([&] {
                    (void)read_file(enhanced_ct({0, 1, 2, 4}, {0, 0, 0, 0}));
                }),
                AllOf(HasSubstr("slice gap = 2 mm (1 missing)"), HasSubstr("frame 4 of ")));
    EXPECT_THAT(error_of([&] {
                    (void)read_file(enhanced_ct({0, 1}, {0, 0}).erase(0x52009230));
                }),
                HasSubstr("does not say where each lies"));
    DicomBuilder few = enhanced_ct({0, 1}, {0, 0});
    few.set(0x52009230, "SQ", sequence_of({DicomBuilder()}));
    EXPECT_THAT(error_of([&] { (void)read_file(few); }), HasSubstr("as many as frames"));
}

}  // namespace
}  // namespace raylign::detail
