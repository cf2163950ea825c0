#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "raylign/io/image.h"
#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

using testing::HasSubstr;

/// A case that would run, with an earlier result in the output folder that no failure may touch.
class BadInput : public testing::Test {
protected:
    void SetUp() override {
        ASSERT_EQ(scene.make_phantom().exit_code, 0);
        ASSERT_EQ(scene.simulate().exit_code, 0);
        std::filesystem::create_directory(folder.folder() / "result");
        write_text_file(folder.path("result/pose.json"), "earlier");
    }

    void TearDown() override {
        EXPECT_EQ(read_text(folder.path("result/pose.json")), "earlier");
        EXPECT_EQ(names_in(folder.folder() / "result"), std::vector<std::string>{"pose.json"});
    }

    void expect_refused(const std::vector<std::string>& arguments, int exit_code,
                        const std::vector<std::string>& words) {
        const ProgramResult result = run_raylign(arguments);
        EXPECT_EQ(result.exit_code, exit_code) << result.err;
        EXPECT_EQ(result.out, "");
        EXPECT_THAT(result.err, testing::StartsWith("raylign " + arguments.front() + ": "));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        for (const std::string& word : words) EXPECT_THAT(result.err, HasSubstr(word));
    }

    /// The arguments of a good run with `option` set to `value`.
    std::vector<std::string> with(const std::string& option, const std::string& value) {
        std::vector<std::string> arguments = scene.register_arguments();
        const auto found = std::ranges::find(arguments, option);
        if (found == arguments.end()) {
            arguments.insert(arguments.end(), {option, value});
        } else {
            *(found + 1) = value;
        }
        return arguments;
    }

    TestFolder folder;
    SmallCase scene{folder};
};

TEST_F(BadInput, UnknownBackendListsTheValidOnes) {
    expect_refused(with("--backend", "cuda"), 2, {"cuda", "auto", "reference"});
}
TEST_F(BadInput, UnknownMethodListsTheValidOnes) {
    expect_refused(with("--method", "powell"), 2, {"powell", "auto", "steepest-descent"});
}
TEST_F(BadInput, UnknownMetricListsTheValidOnes) { expect_refused(with("--metric", "mi"), 2, {"mi", "gc", "ncc"}); }
TEST_F(BadInput, UnknownProjectorListsTheValidOnes) {
    expect_refused(with("--projector", "siddon"), 2, {"siddon", "joseph", "trilinear"});
}
TEST_F(BadInput, UnknownPresetListsTheValidOnes) {
    std::vector<std::string> arguments = with("--hu", "gold");
    std::erase(arguments, "--attenuation");
    expect_refused(arguments, 2, {"gold"});
}

TEST_F(BadInput, ContradictingFlagsAreRefused) {
    expect_refused(scene.register_arguments({"--hu", "plastimatch"}), 2, {"--hu", "--attenuation"});
    expect_refused(scene.register_arguments({"--step", "1"}), 2, {"--step", "trilinear"});
    expect_refused(scene.register_arguments({"--backend", "reference", "--threads", "4"}), 2,
                   {"--threads", "reference"});
    expect_refused(scene.register_arguments({"--backend", "reference", "--device", "0"}), 2, {"--device"});
}

TEST_F(BadInput, NumbersOutOfRangeAreRefused) {
    expect_refused(scene.register_arguments({"--levels", "99"}), 2, {"99", "8"});
    expect_refused(scene.register_arguments({"--max-iterations", "0"}), 2, {"0", "1"});
    expect_refused(scene.register_arguments({"--threads", "many"}), 2, {"--threads"});
    expect_refused(scene.register_arguments({"--projector", "trilinear", "--step", "-1"}), 2, {"step"});
}

TEST_F(BadInput, WholeNumbersAreShownAsSuch) {
    expect_refused(scene.register_arguments({"--levels", "9"}), 2, {"levels = 9: "});
    expect_refused(scene.register_arguments({"--time-limit", "-0.5"}), 2, {"time limit = -0.5: "});
}

TEST_F(BadInput, NegativeSeedsAreRefusedByAllCommands) {
    const std::vector<std::string> inputs{
        "-v", folder.path("spine.mha"), "--attenuation", "--views", folder.path("xrays/views.json"),
        "-o", folder.path("x")};
    const auto refused = [&](std::vector<std::string> arguments, const std::string& pose) {
        arguments.insert(arguments.end(), inputs.begin(), inputs.end());
        arguments.insert(arguments.end(), {pose, folder.path("truth.json"), "--seed=-1"});
        expect_refused(arguments, 2, {"--seed = -1", "[0, 2^64)"});
    };
    refused({"study"}, "--truth");
    refused({"compare"}, "--pose");
    refused({"drr"}, "--pose");
    refused({"register"}, "--start");
}

TEST_F(BadInput, AFifoIsRefusedAtOnceWhereverAFileIsRead) {
    for (const char* name : {"ct.nii", "ct.mha", "views.json", "pose.json", "pose.tfm", "targets.csv", "marks.fcsv"}) {
        ASSERT_EQ(::mkfifo(folder.path(name).c_str(), 0600), 0);
    }
    expect_refused(with("-v", folder.path("ct.nii")), 2, {"ct.nii", "FIFO"});
    expect_refused(with("-v", folder.path("ct.mha")), 2, {"ct.mha", "FIFO"});
    expect_refused(with("--views", folder.path("views.json")), 2, {"views.json", "FIFO"});
    expect_refused(with("--start", folder.path("pose.json")), 2, {"pose.json", "FIFO"});
    expect_refused(with("--truth", folder.path("pose.tfm")), 2, {"pose.tfm", "FIFO"});
    expect_refused(with("--targets", folder.path("targets.csv")), 2, {"targets.csv", "FIFO"});
    expect_refused(with("-v", "/dev/zero"), 2, {"/dev/zero", "device"});
    expect_refused(with("--views", folder.folder().string()), 2, {"folder"});
}

TEST_F(BadInput, NamesWithControlCharactersAreShownOnOneLine) {
    expect_refused(with("-v", folder.path("a\x1b[31m\nraylign: all is well\x07.nii")), 2,
                   {"a\\x1b[31m\\nraylign: all is well\\x07.nii does not exist"});
    write_text_file(folder.path("long.json"),
                    R"({"raylign": 1, "world_from_ct": ")" + std::string(3000000, 'x') + R"("})");
    const ProgramResult result = run_raylign(with("--start", folder.path("long.json")));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_LT(result.err.size(), 6000u);
}

TEST_F(BadInput, MissingFilesAreNamed) {
    for (const char* option : {"-v", "--views", "--start"}) {
        expect_refused(with(option, folder.path("nothing_here.json")), 2, {"nothing_here.json"});
    }
}

TEST_F(BadInput, ATruncatedVolumeIsNamed) {
    const std::string bytes = read_text(folder.path("spine.mha"));
    write_text_file(folder.path("half.mha"), bytes.substr(0, bytes.size() / 2));
    expect_refused(with("-v", folder.path("half.mha")), 2, {"half.mha"});
}

TEST_F(BadInput, AnEmptyVolumeIsNamed) {
    write_text_file(folder.path("empty.nii"), "");
    expect_refused(with("-v", folder.path("empty.nii")), 2, {"empty.nii"});
}

TEST_F(BadInput, AFileOfAnotherFormatIsNamed) {
    expect_refused(with("-v", folder.path("start.json")), 2, {"start.json"});
    expect_refused(with("--views", folder.path("spine.mha")), 2, {"spine.mha"});
}

TEST_F(BadInput, MalformedViewsNameTheLine) {
    write_text_file(folder.path("bad.json"), "{ \"raylign\": 1,\n  \"views\": [\n    { \"name\": \"AP\",, } ] }\n");
    expect_refused(with("--views", folder.path("bad.json")), 2, {"bad.json", "3"});
}

TEST_F(BadInput, AMistypedKeyIsNamed) {
    std::string views = read_text(folder.path("xrays/views.json"));
    views.replace(views.find("\"image\""), 7, "\"imagee\"");
    write_text_file(folder.path("xrays/typo.json"), views);
    expect_refused(with("--views", folder.path("xrays/typo.json")), 2, {"typo.json", "views[0]", "imagee"});
}

TEST_F(BadInput, AStartThatMissesTheDetectorIsRefused) {
    write_text_file(folder.path("away.json"),
                    R"({"raylign": 1, "world_from_ct": [[1,0,0,5000],[0,1,0,0],[0,0,1,9000],[0,0,0,1]]})");
    expect_refused(with("--start", folder.path("away.json")), 2, {"AP"});
}

TEST_F(BadInput, AMirroredStartIsRefused) {
    write_text_file(folder.path("mirror.json"),
                    R"({"raylign": 1, "world_from_ct": [[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]})");
    expect_refused(with("--start", folder.path("mirror.json")), 2, {"mirror.json"});
}

TEST_F(BadInput, AConstantImageIsRefused) {
    write_image(folder.path("xrays/drr_AP.tif"), Image(64, 64, 2.0F));
    expect_refused(scene.register_arguments(), 2, {"AP", "constant"});
}

TEST_F(BadInput, AnImageOfAnotherSizeIsRefused) {
    write_image(folder.path("xrays/drr_AP.tif"), Image(32, 64, 2.0F));
    expect_refused(scene.register_arguments(), 2, {"32", "64"});
}

TEST_F(BadInput, AFileInPlaceOfTheOutputFolderIsRefused) {
    write_text_file(folder.path("in_the_way"), "mine");
    expect_refused(with("-o", folder.path("in_the_way")), 2, {"in_the_way"});
    EXPECT_EQ(read_text(folder.path("in_the_way")), "mine");
}

TEST_F(BadInput, AnUnwritableFolderIsRefused) {
    expect_refused(with("-o", "/proc/raylign_cannot_write_here"), 2, {"/proc/raylign_cannot_write_here"});
}

TEST_F(BadInput, AFullDiskLeavesTheEarlierFiles) {
    for (const std::size_t bytes : {100, 8000, 20000}) {  // in pose.json, in a DRR, in an overlay
        const ProgramResult result =
            run_raylign_on_full_disk(scene.register_arguments({"--max-iterations", "1"}), bytes);
        EXPECT_EQ(result.exit_code, 2) << bytes << result.out;
        EXPECT_THAT(result.err, testing::StartsWith("raylign register: "));
        EXPECT_EQ(names_in(folder.folder() / "result"), std::vector<std::string>{"pose.json"});
    }
}

TEST_F(BadInput, AFullDiskLeavesNoHalfPhantom) {
    const ProgramResult result =
        run_raylign_on_full_disk({"phantom", "box", "--size", "32", "-o", folder.path("half_phantom.mha")}, 5000);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr("half_phantom.mha"));
    EXPECT_FALSE(std::filesystem::exists(folder.path("half_phantom.mha")));
}

TEST_F(BadInput, InputsAreNotOverwritten) {
    expect_refused(with("-o", folder.path("xrays")), 2, {"overwrite", "drr_AP.tif"});
    expect_refused({"drr", "-v", folder.path("spine.mha"), "--attenuation", "--views", folder.path("xrays/views.json"),
                    "--pose", folder.path("truth.json"), "-o", folder.path("xrays")},
                   2, {"overwrite", "views.json"});
}

TEST_F(BadInput, DrrChecksItsOwnNumbers) {
    expect_refused({"drr", "-v", folder.path("spine.mha"), "--views", folder.path("geometry.json"), "--pose",
                    folder.path("truth.json"), "-o", folder.path("x"), "--noise", "-5"},
                   2, {"--noise", "-5"});
    EXPECT_FALSE(std::filesystem::exists(folder.path("x")));
}

TEST_F(BadInput, PhantomListsItsKindsAndChecksItsNumbers) {
    expect_refused({"phantom", "cube", "-o", folder.path("x.mha")}, 2, {"cube", "spine", "ellipsoid"});
    expect_refused({"phantom", "box", "--size", "8,8", "-o", folder.path("x.mha")}, 2, {"--size", "8,8"});
    expect_refused({"phantom", "box", "--size", "0", "-o", folder.path("x.mha")}, 2, {"--size"});
    expect_refused({"phantom", "box", "--spacing", "1,0,1", "-o", folder.path("x.mha")}, 2, {"--spacing"});
    expect_refused({"phantom", "box", "--size", "8", "-o", folder.path("x.pdf")}, 2, {"x.pdf"});
    EXPECT_FALSE(std::filesystem::exists(folder.path("x.mha")));
}

}  // namespace
}  // namespace raylign::detail::test
