#include <gmock/gmock.h>
#include <zlib.h>

#include "io_files.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class NrrdFile : public test::IoTest {
protected:
    struct Text {
        std::string sizes = "3 2 2", encoding = "raw", more = kOblique;
    };
    static std::string header(const Text& text) {
        return "NRRD0005\n# a comment\ntype: short\ndimension: " +
               std::to_string(1 + std::count(text.sizes.begin(), text.sizes.end(), ' ')) + "\nsizes: " + text.sizes +
               "\nendian: little\nencoding: " + text.encoding + "\n" + text.more;
    }
    [[nodiscard]] VolumeFile read(const Text& text, const std::string& data = hu_bytes()) const {
        return read_volume(write("ct.nrrd", header(text) + "\n" + data));
    }
    [[nodiscard]] std::string error(const Text& text, const std::string& data = hu_bytes()) const {
        return error_of([&] { (void)read(text, data); });
    }
    static std::string hu_bytes() { return bytes_of(test::small_hu()); }
    static constexpr const char* kOblique =
        "space: LPS\nspace directions: (0,0.5,0) (-0.75,0,0) (0,0,2)\nspace origin: (1,2,3)\n";
};

Eigen::Vector3d far_voxel(const VolumeFile& file) { return file.volume.grid.ct_from_voxel({2, 1, 1}); }

std::string in_space(const std::string& space, const std::string& more = "") {
    return "space: " + space + "\nspace directions: (0.5,0,0) (0,0.75,0) (0,0,2)\nspace origin: (1,2,3)\n" + more;
}

TEST_F(NrrdFile, SpacesOfThePatientAreTurnedToLps) {
    const Eigen::Vector3d place(2, 2.75, 5);
    for (const char* lps : {"left-posterior-superior", "LPS"}) {
        EXPECT_LT((far_voxel(read({.more = in_space(lps)})) - place).norm(), 1e-12);
    }
    for (const char* ras : {"right-anterior-superior", "RAS"}) {
        EXPECT_LT((far_voxel(read({.more = in_space(ras)})) - Eigen::Vector3d(-2, -2.75, 5)).norm(), 1e-12);
    }
    for (const char* las : {"left-anterior-superior", "LAS"}) {
        EXPECT_LT((far_voxel(read({.more = in_space(las)})) - Eigen::Vector3d(2, -2.75, 5)).norm(), 1e-12);
    }
    EXPECT_LT((far_voxel(read({.more = kOblique})) - Eigen::Vector3d(0.25, 3, 5)).norm(), 1e-12);
}

TEST_F(NrrdFile, SpaceWithTimeIsRead) {
    const std::string more =
        "space: right-anterior-superior-time\nspace directions: (0.5,0,0,0) (0,0.75,0,0) (0,0,2,0) (0,0,0,1)\n"
        "space origin: (1,2,3,0)\n";
    EXPECT_LT((far_voxel(read({.sizes = "3 2 2 1", .more = more})) - Eigen::Vector3d(-2, -2.75, 5)).norm(), 1e-12);
}

TEST_F(NrrdFile, SpacesThatDoNotPlaceThePatientAreRefusedOrNoted) {
    for (const char* bad : {"scanner-xyz", "3D-left-handed"}) {
        EXPECT_THAT(error({.more = in_space(bad)}), HasSubstr("write space: left-posterior-superior"));
    }
    EXPECT_THAT(error({.more = in_space("nowhere")}), HasSubstr("space = nowhere"));
    EXPECT_THAT(read({.more = in_space("3D-right-handed")}).notes, Contains(HasSubstr("taken as LPS")));
    std::string nameless = in_space("LPS");
    nameless.replace(0, 10, "space dimension: 3");
    EXPECT_THAT(read({.more = nameless}).notes, Contains(HasSubstr("no name")));
    EXPECT_THAT(error({.more = "space: LPS\nspacings: 1 1 1\n"}), HasSubstr("no space directions"));
}

TEST_F(NrrdFile, UnitsBecomeMillimetres) {
    const VolumeFile file = read({.more = in_space("LPS", "space units: \"cm\" \"mm\" \"um\"\n")});
    EXPECT_LT((far_voxel(file) - Eigen::Vector3d(20, 2.75, 0.005)).norm(), 1e-12);
    EXPECT_THAT(file.notes, AllOf(Contains(HasSubstr("in cm")), Contains(HasSubstr("in um"))));
    EXPECT_THAT(error({.more = in_space("LPS", "space units: \"cm\" \"ell\" \"mm\"\n")}), HasSubstr("\"ell\""));
    const VolumeFile spaced = read({.more = "spacings: 0.5 0.75 2\nunits: \"m\" \"inch\" \"mm\"\n"});
    EXPECT_LT((spaced.volume.grid.spacing_mm - Eigen::Vector3d(500, 19.05, 2)).norm(), 1e-12);
}

TEST_F(NrrdFile, SpacingsAndAxisMinimaPlaceIt) {
    const Eigen::Vector3d corner(1, 2, 3), half(0.25, 0.375, 1);
    const std::string more = "spacings: 0.5 0.75 2\naxis mins: 1 2 3\n";
    EXPECT_LT((read({.more = more}).volume.grid.origin_mm - corner - half).norm(), 1e-12);
    EXPECT_LT((read({.more = more + "centers: node node node\n"}).volume.grid.origin_mm - corner).norm(), 1e-12);
    EXPECT_THAT(read({.more = ""}).notes, Contains(HasSubstr("no spacing: 1 mm assumed")));
}

TEST_F(NrrdFile, EncodingsAreRead) {
    const std::vector<float> plain = read({}).volume.attenuation_per_mm;
    gzFile file = gzopen(at("z.gz").c_str(), "wb");
    gzwrite(file, hu_bytes().data(), static_cast<unsigned>(hu_bytes().size()));
    gzclose(file);
    const std::string packed = test::content_of(at("z.gz"));
    EXPECT_EQ(read({.encoding = "gzip"}, packed).volume.attenuation_per_mm, plain);
    EXPECT_THAT(error({.encoding = "gzip"}, packed.substr(0, packed.size() / 2)), HasSubstr("truncated"));
    EXPECT_EQ(
        read({.encoding = "text"}, "-1000 -900 -899 -500 -100 0 100 500 1000 1500 2000 3071").volume.attenuation_per_mm,
        plain);
    EXPECT_THAT(error({.encoding = "text"}, "-1000 -900 -899 -500 -100 0 100 500 x 1500 2000 3071"),
                HasSubstr("number 9"));
    std::string hex;
    for (const char c : hu_bytes()) {
        hex += "0123456789abcdef"[static_cast<unsigned char>(c) / 16];
        hex += "0123456789abcdef"[static_cast<unsigned char>(c) % 16];
    }
    EXPECT_EQ(read({.encoding = "hex"}, hex).volume.attenuation_per_mm, plain);
    EXPECT_THAT(error({.encoding = "bzip2"}), HasSubstr("encoding = bzip2"));
}

TEST_F(NrrdFile, SkippedBytesAndLinesAreHeeded) {
    const std::vector<float> plain = read({}).volume.attenuation_per_mm;
    const std::string place = kOblique;
    EXPECT_EQ(
        read({.more = place + "line skip: 2\nbyte skip: 3\n"}, "one\ntwo\nxyz" + hu_bytes()).volume.attenuation_per_mm,
        plain);
    EXPECT_EQ(read({.more = place + "byte skip: -1\n"}, "12345" + hu_bytes()).volume.attenuation_per_mm, plain);
    EXPECT_THAT(error({.more = place + "byte skip: 1000000\n"}), HasSubstr("truncated"));
    EXPECT_THAT(error({.more = place + "byte skip: -2\n"}), HasSubstr("byteskip"));
}

TEST_F(NrrdFile, SlicesInFilesOfTheirOwnAreReadAndCounted) {
    (void)write("s1.raw", hu_bytes().substr(0, 12));
    (void)write("s2.raw", hu_bytes().substr(12));
    const auto read_with = [&](const std::string& data) {
        return read_volume(write("ct.nhdr", header({.more = kOblique + ("data file: " + data) + "\n"})));
    };
    const auto error_with = [&](const std::string& data) { return error_of([&] { (void)read_with(data); }); };
    for (const char* good : {"LIST\ns1.raw\ns2.raw", "LIST 3\ns1.raw\ns2.raw", "s%d.raw 1 2 1", "s%01d.raw 1 2 1 2"}) {
        EXPECT_EQ(read_with(good).volume.attenuation_per_mm, read({}).volume.attenuation_per_mm) << good;
    }
    EXPECT_THAT(error_with("LIST\ns1.raw"), AllOf(HasSubstr("names 1 files"), HasSubstr("asks for 2")));
    EXPECT_THAT(error_with("s%d.raw 1 3 1"), HasSubstr("names 3 files"));
    EXPECT_THAT(error_with("%s%s%n 1 2 1"), HasSubstr("a name with one %d"));
    EXPECT_THAT(error_with("s1.raw"), AllOf(HasSubstr("24 bytes"), HasSubstr("s1.raw has 12")));
    EXPECT_THAT(error_with("s9.raw"), HasSubstr("s9.raw does not exist"));
}

TEST_F(NrrdFile, AxesOutsideSpaceAreTold) {
    const std::string spaced = "space: LPS\nspace origin: (1,2,3)\n";
    EXPECT_EQ(read({.sizes = "1 3 2 2", .more = spaced + "space directions: none (0.5,0,0) (0,0.75,0) (0,0,2)\n"})
                  .volume.grid.size,
              Eigen::Vector3i(3, 2, 2));
    EXPECT_THAT(error({.sizes = "2 3 2 1",
                       .more = spaced + "space directions: none (0.5,0,0) (0,0.75,0) (0,0,2)\n"
                                        "kinds: vector domain domain domain\n"}),
                HasSubstr("numbers per voxel = 2"));
    EXPECT_THAT(error({.more = spaced + "space directions: (0.5,0,0) (0,0.75,0) none\nkinds: domain domain domain\n"}),
                HasSubstr("axis 2 has no space direction"));
}

TEST_F(NrrdFile, SizesOutOfRangeAreRefused) {
    for (const char* bad : {"3 2 0", "3 2 -1", "3 2 1e12", "3 2 x"}) {
        EXPECT_THAT(error({.sizes = bad}), HasSubstr("sizes")) << bad;
    }
    EXPECT_THAT(error({.sizes = "2147483647 2147483647 2147483647"}), HasSubstr("its header states"));
    EXPECT_THAT(error({.sizes = "3000 2000 2000", .encoding = "gzip"}), HasSubstr("its header states"));
    std::string text = header({}) + "\n" + hu_bytes();
    text.replace(text.find("dimension: 3"), 12, "dimension: 99");
    EXPECT_THAT(error_of([&] { (void)read_volume(write("a.nrrd", text)); }), HasSubstr("dimension"));
}

}  // namespace
}  // namespace raylign::detail
