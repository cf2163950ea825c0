#include <gmock/gmock.h>
#include <zlib.h>

#include "io_files.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using test::MetaText;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class MetaFile : public test::IoTest {
protected:
    [[nodiscard]] VolumeFile read(const MetaText& meta, const std::string& before = "") const {
        return read_volume(write("ct.mha", meta.with(before + hu_bytes())));
    }
    [[nodiscard]] std::string error(const MetaText& meta) const {
        return error_of([&] { (void)read(meta); });
    }
    /// With `data` for ElementDataFile, in a file of its own.
    [[nodiscard]] std::filesystem::path detached(const std::string& data, const MetaText& meta = {}) const {
        std::string header = meta.with("");
        header.replace(header.find("LOCAL"), 5, data);
        return write("ct.mhd", header);
    }
    void write_slices() const {
        (void)write("s1.raw", hu_bytes().substr(0, 12));
        (void)write("s2.raw", hu_bytes().substr(12));
        (void)write("s3.raw", std::string(12, '\0'));
    }
    static std::string hu_bytes() { return bytes_of(test::small_hu()); }
};

TEST_F(MetaFile, DistanceUnitsAreHeeded) {
    const VolumeFile file = read({.more = "DistanceUnits = cm\n"});
    EXPECT_LT((file.volume.grid.ct_from_voxel({2, 1, 1}) - Eigen::Vector3d(20, 27.5, 50)).norm(), 1e-12);
    EXPECT_THAT(file.notes, Contains(HasSubstr("in cm")));
    for (const char* mm : {"mm", "?"}) {
        const std::string key = std::string("DistanceUnits = ") + mm + "\n";
        EXPECT_EQ(read({.more = key}).volume.grid.spacing_mm, Eigen::Vector3d(0.5, 0.75, 2));
    }
    EXPECT_THAT(error({.more = "DistanceUnits = furlong\n"}), HasSubstr("DistanceUnits = furlong"));
}

TEST_F(MetaFile, IntensityFunctionIsApplied) {
    const VolumeFile file =
        read({.more = "ElementToIntensityFunctionSlope = 2\nElementToIntensityFunctionOffset = -10\n"});
    EXPECT_FLOAT_EQ(file.volume(2, 1, 1), static_cast<float>(0.0193 * (1 + (2 * 3071 - 10) / 1000.0)));
    EXPECT_THAT(file.notes, Contains(HasSubstr("stored * 2 + -10")));
    EXPECT_THAT(error({.more = "ElementToIntensityFunctionSlope = 0\n"}), HasSubstr("Slope = 0"));
}

TEST_F(MetaFile, HeaderSizeIsHeeded) {
    const std::vector<float> plain = read({}).volume.attenuation_per_mm;
    (void)write("ct.raw", "12345" + hu_bytes());
    for (const char* size : {"5", "-1"}) {
        const MetaText meta{.more = std::string("HeaderSize = ") + size + "\n"};
        EXPECT_EQ(read_volume(detached("ct.raw", meta)).volume.attenuation_per_mm, plain);
        EXPECT_EQ(read(meta, "12345").volume.attenuation_per_mm, plain);
    }
    EXPECT_THAT(error({.more = "HeaderSize = 7\n"}), HasSubstr("where they begin cannot be told"));
}

TEST_F(MetaFile, OrientationThatContradictsTheMatrixIsNoted) {
    for (const char* same : {"RAI", "LPS", "???"}) {
        const MetaText meta{.more = std::string("AnatomicalOrientation = ") + same + "\n"};
        EXPECT_THAT(read(meta).notes, Not(Contains(HasSubstr("AnatomicalOrientation"))));
    }
    EXPECT_THAT(read({.more = "AnatomicalOrientation = RAS\n"}).notes, Contains(HasSubstr("TransformMatrix (RAI)")));
    MetaText bare{.more = "AnatomicalOrientation = RAS\n"};
    std::string header = bare.with(hu_bytes());
    header.replace(header.find("TransformMatrix"), 15, "UnknownKey12345");
    EXPECT_THAT(error_of([&] { (void)read_volume(write("a.mha", header)); }), HasSubstr("write TransformMatrix"));
}

TEST_F(MetaFile, CentreOfRotationOfTurnedAxesIsRefused) {
    const MetaText turned{.matrix = "0 1 0 -1 0 0 0 0 1", .more = "CenterOfRotation = 1 0 0\n"};
    EXPECT_THAT(error(turned), HasSubstr("CenterOfRotation = 1 0 0"));
    EXPECT_EQ(read({.more = "CenterOfRotation = 1 0 0\n"}).volume.grid.origin_mm, Eigen::Vector3d(1, 2, 3));
}

TEST_F(MetaFile, DimensionsOutOfRangeAreRefused) {
    for (const int bad : {-1, 0, 11, 20}) {
        MetaText meta;
        meta.dimensions = bad;
        EXPECT_THAT(error(meta), HasSubstr("NDims"));
    }
    for (const char* bad : {"3 2", "3 2 2 2", "3 2 0", "3 2 -2", "3 2 x", "3 2 1e10", "3 2 2.5"}) {
        EXPECT_THAT(error({.dims = bad}), HasSubstr("DimSize"));
    }
    EXPECT_THAT(error({.dims = "2147483647 2147483647 2147483647"}), HasSubstr("its header states"));
    EXPECT_THAT(error({.type = "MET_STRING"}), HasSubstr("ElementType = MET_STRING"));
}

TEST_F(MetaFile, ListsAndPatternsOfSlicesAreRead) {
    write_slices();
    const std::vector<float> plain = read({}).volume.attenuation_per_mm;
    for (const char* data : {"LIST\ns1.raw\ns2.raw", "LIST 2\ns1.raw\n\ns2.raw\n", "s%d.raw 1 2 1", "s%d.raw 1 2",
                             "s%d.raw 1", "s%d.raw", "s%01d.raw 1 2 1"}) {
        EXPECT_EQ(read_volume(detached(data)).volume.attenuation_per_mm, plain) << data;
    }
    EXPECT_EQ(read_volume(detached("s%d.raw 2 1 -1")).volume(0, 0, 1), plain.front());
}

TEST_F(MetaFile, ListsAndPatternsThatDoNotNameAllSlicesAreCounted) {
    write_slices();
    const auto error_with = [&](const char* data) { return error_of([&] { (void)read_volume(detached(data)); }); };
    EXPECT_THAT(error_with("LIST\ns1.raw"), AllOf(HasSubstr("names 1 files"), HasSubstr("asks for 2")));
    EXPECT_THAT(error_with("LIST\n\n"), HasSubstr("names 0 files"));
    EXPECT_THAT(error_with("s%d.raw 1 3 1"), HasSubstr("names 3 files"));
    EXPECT_THAT(error_with("s%d.raw 1 2 2"), HasSubstr("names 1 files"));
    EXPECT_THAT(error_with("LIST\ns1.raw\ns4.raw"), AllOf(HasSubstr("s4.raw does not exist"), HasSubstr("ct.mhd")));
    EXPECT_THAT(error_with("s%d.raw 1 2 0"), HasSubstr("by 0"));
}

TEST_F(MetaFile, PatternsThatAreNoNumbersAreRefused) {
    for (const char* bad :
         {"%s.raw 1 2 1", "%s%s%s%s 1 2 1", "%999999999d 1 2 1", "%d%d 1 2 1", "%n 1 2 1", "% 1 2 1", "%100d 1 2 1"}) {
        EXPECT_THAT(error_of([&] { (void)read_volume(detached(bad)); }), HasSubstr("a name with one %d")) << bad;
    }
}

TEST_F(MetaFile, DetachedVoxelsThatAreTooFewAreRefused) {
    (void)write("ct.raw", hu_bytes().substr(0, 20));
    EXPECT_THAT(error_of([&] { (void)read_volume(detached("ct.raw")); }),
                AllOf(HasSubstr("24 bytes"), HasSubstr("ct.raw has 20")));
    EXPECT_THAT(error_of([&] { (void)read_volume(detached("ct.raw", {.dims = "30000 30000 1000"})); }),
                HasSubstr("its header states"));
    EXPECT_THAT(error_of([&] { (void)read_volume(detached("none.raw")); }), HasSubstr("none.raw does not exist"));
}

TEST_F(MetaFile, NamesThatAreNoFilesAreRefused) {
    const auto error_with = [&](const std::string& data) {
        return error_of([&] { (void)read_volume(detached(data)); });
    };
    EXPECT_THAT(error_with(std::string(2000, 'x')), HasSubstr("can be none"));
    EXPECT_THAT(error_with("a\x01.raw"), HasSubstr("can be none"));
    EXPECT_THAT(error_with(std::string(500, 'x')), HasSubstr("ct.mhd"));
    EXPECT_THAT(error_with("/dev/zero"), HasSubstr("no regular file"));
    EXPECT_THAT(error_with("."), HasSubstr("is a folder"));
}

TEST_F(MetaFile, CompressedAndWrittenOutVoxelsAreRead) {
    const std::vector<float> plain = read({}).volume.attenuation_per_mm;
    std::string packed(200, '\0');
    uLongf length = packed.size();
    const std::string hu = hu_bytes();
    compress(reinterpret_cast<Bytef*>(packed.data()), &length, reinterpret_cast<const Bytef*>(hu.data()), hu.size());
    const MetaText meta{.more = "CompressedData = True\n"};
    EXPECT_EQ(read_volume(write("z.mha", meta.with(packed.substr(0, length)))).volume.attenuation_per_mm, plain);
    EXPECT_THAT(error_of([&] { (void)read_volume(write("z.mha", meta.with(packed.substr(0, length / 2)))); }),
                HasSubstr("truncated"));
    EXPECT_THAT(error_of([&] { (void)read_volume(write("z.mha", meta.with("no deflate stream"))); }),
                HasSubstr("truncated or damaged"));
    std::string text = MetaText().with("-1000 -900 -899 -500 -100 0\n100 500 1000 1500 2000 3071\n");
    text.replace(text.find("BinaryData = True"), 17, "BinaryData = False");
    EXPECT_EQ(read_volume(write("t.mha", text)).volume.attenuation_per_mm, plain);
    EXPECT_THAT(error_of([&] { (void)read_volume(write("t.mha", text.substr(0, text.size() - 6))); }),
                HasSubstr("truncated"));
}

TEST_F(MetaFile, KeyStatedTwiceIsRefused) {
    EXPECT_THAT(error({.more = "Offset = 4 5 6\n"}), HasSubstr("states Offset twice"));
    EXPECT_THAT(error_of([&] { (void)read_volume(write("a.mha", "NDims = 3\n")); }), HasSubstr("no ElementDataFile"));
}

}  // namespace
}  // namespace raylign::detail
