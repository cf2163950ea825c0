#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/shared/options.h"
#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "tests/apps/small_case.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

using apps::volume_read_options;
using apps::VolumeFlags;
using testing::HasSubstr;

TEST(ObjectFlags, BoxInMillimetresOrVoxels) {
    VolumeFlags flags;
    flags.object = "-10,-20.5,3,10,20,30";
    const ObjectRegion mm = volume_read_options(flags).object;
    ASSERT_TRUE(mm.box_mm.has_value());
    EXPECT_EQ(mm.box_mm->low_mm, Eigen::Vector3d(-10, -20.5, 3));
    EXPECT_EQ(mm.box_mm->high_mm, Eigen::Vector3d(10, 20, 30));
    flags.object = "voxels:1,2,3,10,20,30";
    const ObjectRegion voxels = volume_read_options(flags).object;
    ASSERT_TRUE(voxels.box_voxels.has_value());
    EXPECT_EQ(voxels.box_voxels->end, Eigen::Vector3i(10, 20, 30));
    EXPECT_TRUE(volume_read_options(VolumeFlags{}).object.is_whole());
}

TEST(ObjectFlags, FaultsAreNamed) {
    const auto message = [](const VolumeFlags& flags) { return error_of([&] { (void)volume_read_options(flags); }); };
    for (const char* object :
         {"1,2,3", "1,2,3,4,5,x", "1,2,3,0,5,6", "voxels:1.5,2,3,4,5,6", "voxels:-1,0,0,4,5,6", "nan,0,0,1,1,1"}) {
        VolumeFlags flags;
        flags.object = object;
        EXPECT_THAT(message(flags), HasSubstr("--object")) << object;
    }
    VolumeFlags flags;
    flags.label = {"3"};
    EXPECT_THAT(message(flags), HasSubstr("give --labels FILE"));
    flags.labels = "map.nii";
    flags.label = {"2.5"};
    EXPECT_THAT(message(flags), HasSubstr("a whole number of up to 32 bits, or a name"));
    flags = {};
    flags.label_table = "names.csv";
    EXPECT_THAT(message(flags), HasSubstr("give --labels FILE"));
    flags = {};
    flags.clip = 200;
    flags.bone_threshold = 300;
    EXPECT_THAT(message(flags), HasSubstr("above --bone-threshold"));
}

TEST(ObjectFlags, LabelsAreNumbersOrNames) {
    VolumeFlags flags;
    flags.labels = "map.nii";
    flags.label_table = "names.csv";
    flags.label = {"29", "vertebrae_L3", "-1"};
    const ObjectRegion object = volume_read_options(flags).object;
    EXPECT_EQ(object.labels, (std::vector<std::int32_t>{29, -1}));
    EXPECT_EQ(object.label_names, std::vector<std::string>{"vertebrae_L3"});
    EXPECT_EQ(object.label_table, "names.csv");
}

TEST(Seed, IsAWholeNumber) {
    EXPECT_EQ(apps::parse_seed("18446744073709551615"), ~std::uint64_t{0});
    for (const char* text : {"-1", "1.5", "", "1e3", "18446744073709551616"}) {
        EXPECT_THAT(error_of([&] { (void)apps::parse_seed(text); }), HasSubstr("--seed")) << text;
    }
}

TEST(Seed, ANegativeOneEndsTheProgram) {
    const TestFolder folder;
    const SmallCase scene(folder);
    ASSERT_EQ(scene.make_phantom().exit_code, 0);
    ASSERT_EQ(scene.simulate().exit_code, 0);
    const ProgramResult result = run_raylign(scene.register_arguments({"--seed", "-1"}));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("--seed = -1"));
}

TEST(Drr, DoesNotOverwriteTheImagesThatItsViewsName) {
    const TestFolder folder;
    const SmallCase scene(folder);
    ASSERT_EQ(scene.make_phantom().exit_code, 0);
    ASSERT_EQ(scene.simulate().exit_code, 0);
    const std::string before = read_text(folder.path("xrays/drr_AP.tif"));
    // views.json lies elsewhere, but names the images in xrays/.
    std::string views = read_text(folder.path("xrays/views.json"));
    for (const char* name : {"drr_AP.tif", "drr_LAT.tif"}) views.replace(views.find(name), 0, "xrays/");
    write_text_file(folder.path("other.json"), views);
    const ProgramResult result =
        run_raylign({"drr", "-v", folder.path("spine.mha"), "--attenuation", "--views", folder.path("other.json"),
                     "--pose", folder.path("start.json"), "-o", folder.path("xrays")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("overwrite the input"));
    EXPECT_EQ(read_text(folder.path("xrays/drr_AP.tif")), before);
}

TEST(Register, TakesABoxOfTheCt) {
    const TestFolder folder;
    const SmallCase scene(folder);
    ASSERT_EQ(scene.make_phantom().exit_code, 0);
    ASSERT_EQ(scene.simulate().exit_code, 0);
    const ProgramResult result = run_raylign(
        scene.register_arguments({"--object", "-60,-60,-60,60,60,60", "--max-iterations", "1", "--levels", "1"}));
    ASSERT_LE(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.out, HasSubstr("cropped to what is left"));
}

}  // namespace
}  // namespace raylign::detail::test
