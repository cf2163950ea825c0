#include "core/io/volumes/label_names.h"

#include <gmock/gmock.h>

#include "io_files.h"
#include "raylign/io/volume.h"

namespace raylign::detail {
namespace {

using test::bytes_of;
using test::error_of;
using test::MetaText;
using test::NiftiBytes;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;

constexpr const char* kXml =
    "<?xml version=\"1.0\"?><CaretExtension><VolumeInformation Index=\"0\"><LabelTable>\n"
    "<Label Key=\"1\" Red=\"0\" Green=\"1\" Blue=\"0\" Alpha=\"1\"><![CDATA[femur]]></Label>\n"
    "<Label Key=\"2\" Red=\"0\"><![CDATA[ tibia ]]></Label></LabelTable></VolumeInformation></CaretExtension>";

TEST(LabelNames, TotalSegmentatorsAreCompiledIn) {
    const LabelNames names = total_segmentator_names();
    EXPECT_EQ(names.size(), 117);
    EXPECT_EQ(names.at(1), "spleen");
    EXPECT_EQ(names.at(117), "costal_cartilages");
    EXPECT_EQ(label_of(names, "vertebrae_L3", ""), 29);
    EXPECT_EQ(label_of(names, "Hip_Left", ""), 77);
}

TEST(LabelNames, UnknownNamesSuggestTheNearest) {
    const LabelNames names = total_segmentator_names();
    EXPECT_THAT(error_of([&] { (void)label_of(names, "vertebra_L3", "the table"); }),
                AllOf(HasSubstr("label vertebra_L3 is not one of the table"), HasSubstr("did you mean vertebrae_L3?")));
    EXPECT_THAT(error_of([&] { (void)label_of(names, "femur", "the table"); }),
                HasSubstr("did you mean femur_left, femur_right?"));
    EXPECT_THAT(error_of([&] { (void)label_of(names, "vertebrae_L9", "the table"); }),
                HasSubstr("did you mean vertebrae_L5, vertebrae_L4, vertebrae_L3, vertebrae_L2, vertebrae_L1"));
    EXPECT_THAT(error_of([&] { (void)label_of(names, "rib", "the table"); }), HasSubstr("rib_left_1, "));
    EXPECT_THAT(error_of([&] { (void)label_of(names, "rib", "the table"); }), HasSubstr(", ...?"));
    EXPECT_THAT(error_of([&] { (void)label_of(names, "??", "the table"); }), HasSubstr("117 labels, such as spleen"));
    EXPECT_THAT(error_of([&] {
                    (void)label_of({{3, "rib"}, {5, "Rib"}}, "rib", "t");
                }),
                AllOf(HasSubstr("3 and 5"), HasSubstr("give its number")));
}

TEST(LabelNames, XmlOfANiftiExtensionIsRead) {
    EXPECT_THAT(label_names_in_xml(kXml), ElementsAre(Pair(1, "femur"), Pair(2, "tibia")));
    for (const char* none :
         {"", "<Label ", "<Label Key=\"x\"><![CDATA[a]]></Label>", "<Label Key=\"1\">]]><![CDATA["}) {
        EXPECT_THAT(label_names_in_xml(none), testing::IsEmpty()) << none;
    }
}

class LabelTable : public test::IoTest {
protected:
    [[nodiscard]] LabelNames read(const std::string& text) const { return read_label_names(write("t.csv", text)); }
    [[nodiscard]] std::string error(const std::string& text) const {
        return error_of([&] { (void)read(text); });
    }
};

TEST_F(LabelTable, CsvIsRead) {
    const auto both = ElementsAre(Pair(1, "femur"), Pair(20, "tibia"));
    for (const char* text : {"number,name\n1,femur\n20,tibia\n", "# mine\r\n1, femur\r\n\r\n20 ,tibia\r\n",
                             "1;femur\n20;tibia", "index\tname\n1\tfemur\n20\ttibia\n", "1 femur\n20 tibia",
                             "LabelValue,Name,Color_R\n1,femur,128\n20,tibia,9\n", "1,\"femur\"\n20,\"tibia\"\n"}) {
        EXPECT_THAT(read(text), both) << text;
    }
    EXPECT_THAT(read("1 left femur\n"), ElementsAre(Pair(1, "left femur")));
}

TEST_F(LabelTable, ColourTableOf3DSlicerIsRead) {
    EXPECT_THAT(read("# Color table file bones.ctbl\n# 3 values\n0 Background 0 0 0 0\n1 femur_left 128 174 128 255\n"
                     "2 left tibia 241 214 145 255\n"),
                ElementsAre(Pair(0, "Background"), Pair(1, "femur_left"), Pair(2, "left tibia")));
}

TEST_F(LabelTable, LabelDescriptionsOfItkSnapAreRead) {
    EXPECT_THAT(read("################\n# ITK-SnAP Label Description File\n################\n"
                     "    0     0    0    0        0  0  0    \"Clear Label\"\n"
                     "    7   255    0    0        1  1  1    \"left femur\"\n"),
                ElementsAre(Pair(0, "Clear Label"), Pair(7, "left femur")));
}

TEST_F(LabelTable, FaultsNameTheLine) {
    EXPECT_THAT(error("1,femur\n2\n"), AllOf(HasSubstr("line 2"), HasSubstr("t.csv")));
    EXPECT_THAT(error("1,femur\n2,\n"), HasSubstr("line 2"));
    EXPECT_THAT(error("1,femur\nx2,tibia\n"), HasSubstr("line 2"));
    EXPECT_THAT(error("l1,femur\n2,tibia\n"), HasSubstr("line 1"));  // a typing error is no heading
    EXPECT_THAT(error("1.5,femur\n"), HasSubstr("line 1"));
    EXPECT_THAT(error("1,femur\n1,tibia\n"), HasSubstr("label 1 twice: femur and tibia"));
    EXPECT_THAT(error("# nothing\n"), HasSubstr("has no labels"));
}

/// A CT of 3 x 2 x 2 voxels and a map of it with labels 1 and 29.
class LabelByName : public test::IoTest {
protected:
    void SetUp() override {
        IoTest::SetUp();
        ct_ = write("ct.mha", MetaText().with(bytes_of(std::vector<std::int16_t>(12, 500))));
    }
    static std::string labels() { return bytes_of(std::vector<std::int16_t>{0, 1, 1, 0, 0, 0, 29, 29, 29, 0, 0, 0}); }
    [[nodiscard]] std::filesystem::path plain_map() const { return write("map.mha", MetaText().with(labels())); }
    [[nodiscard]] std::filesystem::path named_nifti() const {
        NiftiBytes nifti;
        nifti.sform = {-0.5F, 0, 0, -1, 0, -0.75F, 0, -2, 0, 0, 2, 3};
        nifti.extension = std::string(8, '\1') + kXml;
        nifti.offset_slope_intercept[0] = static_cast<float>(352 + nifti.extension.size());
        return write("map.nii", nifti.with(labels()));
    }
    [[nodiscard]] std::filesystem::path segmentation() const {
        return write("map.seg.nrrd",
                     "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n"
                     "space directions: (0.5,0,0) (0,0.75,0) (0,0,2)\nkinds: domain domain domain\nendian: little\n"
                     "encoding: raw\nspace origin: (1,2,3)\nSegment0_Name:=left femur\nSegment0_LabelValue:=29\n"
                     "Segment1_LabelValue:=1\nSegment1_Name:=patella\n\n" +
                         labels());
    }
    [[nodiscard]] VolumeFile read(const std::filesystem::path& map, const std::vector<std::string>& names,
                                  const std::filesystem::path& table = {}) const {
        return read_volume(ct_, {.object = {.label_map = map, .label_names = names, .label_table = table}});
    }

    std::filesystem::path ct_;
};

TEST_F(LabelByName, TotalSegmentatorsNamesServeAMapWithoutNames) {
    const VolumeFile file = read(plain_map(), {"vertebrae_L3"});
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 1, 1));
    EXPECT_THAT(file.notes, Contains(AllOf(HasSubstr("label 29 (vertebrae_L3)"), HasSubstr("TotalSegmentator"))));
    EXPECT_THAT(error_of([&] { (void)read(plain_map(), {"vertebrae_L4"}); }),
                AllOf(HasSubstr("label = 28"), HasSubstr("28 (vertebrae_L4)"), HasSubstr("1, 29")));
}

TEST_F(LabelByName, TheMapsOwnNamesCountFirst) {
    const VolumeFile nifti = read(named_nifti(), {"femur"});
    EXPECT_EQ(nifti.volume.grid.size, Eigen::Vector3i(2, 1, 1));
    EXPECT_THAT(nifti.notes, Contains(AllOf(HasSubstr("label 1 (femur)"), HasSubstr("the names in"))));
    EXPECT_THAT(error_of([&] { (void)read(named_nifti(), {"spleen"}); }), HasSubstr("map.nii"));
    EXPECT_EQ(read(segmentation(), {"left femur"}).volume.grid.size, Eigen::Vector3i(3, 1, 1));
    EXPECT_EQ(read(segmentation(), {"left femur", "patella"}).volume.grid.size, Eigen::Vector3i(3, 1, 2));
}

TEST_F(LabelByName, ATableGivenCountsBeforeAll) {
    const auto table = write("names.csv", "1,kneecap\n29,thigh\n");
    const VolumeFile file = read(named_nifti(), {"thigh"}, table);
    EXPECT_EQ(file.volume.grid.size, Eigen::Vector3i(3, 1, 1));
    EXPECT_THAT(file.files, Contains(table));
    EXPECT_THAT(error_of([&] { (void)read(plain_map(), {"kneecup"}, table); }), HasSubstr("did you mean kneecap?"));
}

TEST_F(LabelByName, NumbersNeedNoNames) {
    const VolumeFile file = read_volume(ct_, {.object = {.label_map = plain_map(), .labels = {29}}});
    EXPECT_THAT(file.notes, Contains(HasSubstr("label 29 of")));
    EXPECT_THAT(file.notes, Not(Contains(HasSubstr("TotalSegmentator"))));
}

}  // namespace
}  // namespace raylign::detail
