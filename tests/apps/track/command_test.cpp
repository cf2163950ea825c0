#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/track/options.h"
#include "core/base/error.h"
#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "tests/apps/track/track_case.h"
#include "tests/support/errors.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

struct Table {
    std::vector<std::string> columns;
    std::vector<std::vector<std::string>> rows;

    [[nodiscard]] std::string cell(std::size_t row, const std::string& column) const {
        const auto found = std::ranges::find(columns, column);
        return found == columns.end() ? "no column " + column : rows[row][found - columns.begin()];
    }
    [[nodiscard]] double number(std::size_t row, const std::string& column) const {
        return std::stod(cell(row, column));
    }
};

Table read_table(const std::string& path) {
    Table table;
    std::istringstream lines(read_text(path));
    for (std::string line; std::getline(lines, line);) {
        std::vector<std::string> cells(1);
        for (const char c : line) {
            if (c == ',') {
                cells.emplace_back();
            } else {
                cells.back() += c;
            }
        }
        if (table.columns.empty()) {
            table.columns = cells;
        } else {
            table.rows.push_back(cells);
        }
    }
    return table;
}

class TrackCommand : public testing::Test {
protected:
    TestFolder folder;
    TrackCase scene{folder};
};

TEST_F(TrackCommand, FollowsTwoBonesAndTellsTheirJoint) {
    scene.write_frames(1, 8);
    scene.write_frame("LAT", 4, Image(72, 72, 1.5F));  // no beam
    std::filesystem::remove(folder.path("AP.0006.tif"));
    const ProgramResult run = run_raylign(scene.both());
    EXPECT_EQ(run.exit_code, 1) << run.err << run.out;
    EXPECT_THAT(run.out, AllOf(HasSubstr("femur: 6 of 8 frames ok"), HasSubstr("tibia: 6 of 8"), HasSubstr("frames/s"),
                               HasSubstr("view AP lacks 1 of 8 frames")));
    EXPECT_THAT(names_in(folder.folder() / "track"),
                ElementsAre("femur.tra", "frames_AP.sha256", "frames_LAT.sha256", "joint_femur_tibia.csv", "tibia.tra",
                            "track.html", "track.journal", "track.json", "trajectory.csv"));
    const auto rows = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(rows.size(), 16u);
    for (const TrajectoryRow& row : rows) {
        const int frame = row.frame.frame;
        const bool is_gap = frame == 4 || frame == 6;
        EXPECT_EQ(row.frame.status, is_gap ? TrackStatus::missing : TrackStatus::ok)
            << row.object << " " << frame << ": " << testing::PrintToString(row.frame.reasons);
        if (is_gap) continue;
        const bool femur = row.object == "femur";
        EXPECT_LT(centre_error_mm(row, femur ? TrackCase::femur(frame) : TrackCase::tibia(frame),
                                  femur ? TrackCase::kFemurCentre : TrackCase::kTibiaCentre),
                  0.5)
            << row.object << " " << frame;
    }
    EXPECT_THAT(rows[6].frame.reasons, ElementsAre(AllOf(HasSubstr("LAT"), HasSubstr("empty"))));
    EXPECT_THAT(rows[10].frame.reasons, ElementsAre(HasSubstr("AP has no frame 6")));

    const Table joint = read_table(folder.path("track/joint_femur_tibia.csv"));
    ASSERT_EQ(joint.rows.size(), 8u);
    for (std::size_t i = 0; i < joint.rows.size(); ++i) {
        const int frame = static_cast<int>(i) + 1;
        if (frame == 4 || frame == 6) {
            EXPECT_EQ(joint.cell(i, "status"), "missing");
            EXPECT_EQ(joint.cell(i, "angle_1_x_deg"), "");
            continue;
        }
        EXPECT_NEAR(joint.number(i, "angle_1_x_deg"), TrackCase::flexion_deg(frame), 1) << frame;
        EXPECT_NEAR(joint.number(i, "angle_2_y_deg"), 0, 1) << frame;
        EXPECT_NEAR(joint.number(i, "angle_3_z_deg"), 0.5 * frame, 1.5)
            << frame << ": about the long axis, the weakest";
        EXPECT_NEAR(joint.number(i, "helical_angle_deg"), 4 * (frame - 1), 1.2) << frame;
    }
    std::istringstream tra(read_text(folder.path("track/tibia.tra")));
    std::vector<std::string> lines;
    for (std::string line; std::getline(tra, line);) lines.push_back(line);
    ASSERT_EQ(lines.size(), 8u);
    EXPECT_TRUE(lines[3].starts_with("NaN,NaN,")) << lines[3];
    EXPECT_EQ(std::ranges::count(lines[0], ','), 15);
}

TEST_F(TrackCommand, OneObjectByTheNamesInViewsJsonAndAMultiFrameFile) {
    scene.write_femur_frames(1, 4);
    json views = json::parse(read_text(folder.path("geometry.json")));
    views["views"][0]["frames"] = "AP.%d.tif";
    views["views"][1]["frames"] = {"LAT.0001.tif", "LAT.0002.tif", "LAT.0003.tif", "LAT.0004.tif"};
    write_text_file(folder.path("views.json"), views.dump());
    auto arguments = scene.femur_alone({"--json", "--smooth", "auto"});
    std::ranges::replace(arguments, folder.path("geometry.json"), folder.path("views.json"));
    const ProgramResult run = run_raylign(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err << run.out;
    const json report = json::parse(run.out);
    EXPECT_EQ(report, json::parse(read_text(folder.path("track/track.json"))));
    EXPECT_TRUE(report.at("verdict").at("ok"));
    EXPECT_TRUE(report.at("complete"));
    EXPECT_EQ(report.at("frames").at("done"), 4);
    EXPECT_GT(report.at("frames_per_second"), 0);
    EXPECT_EQ(report.at("objects").at(0).at("frames_by_status").at("ok"), 4);
    EXPECT_EQ(report.at("objects").at(0).at("frames").size(), 4u);
    EXPECT_EQ(report.at("inputs").size(), 5u) << "CT, views, start, and two lists of frames";
    EXPECT_THAT(names_in(folder.folder() / "track"), Contains("object.tra"));
    EXPECT_THAT(read_text(folder.path("track/track.html")), HasSubstr("\"kind\":\"track\""));
    const auto rows = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(rows.size(), 4u);
    for (const TrajectoryRow& row : rows) {
        EXPECT_LT(centre_error_mm(row, TrackCase::femur(row.frame.frame), TrackCase::kFemurCentre), 0.4);
    }
    EXPECT_GT(report.at("objects").at(0).at("jitter").at("translation_mm"), 0);
    const auto smooth = read_trajectory(folder.path("track/trajectory_smooth.csv"));
    ASSERT_EQ(smooth.size(), 4u);
    for (const TrajectoryRow& row : smooth) {
        EXPECT_LT(centre_error_mm(row, TrackCase::femur(row.frame.frame), TrackCase::kFemurCentre), 0.4);
    }
    const ProgramResult part =
        run_raylign(scene.femur_alone({"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames",
                                       "LAT=" + folder.path("LAT.%d.tif"), "--first", "2", "--every", "2", "--quiet"}));
    EXPECT_EQ(part.exit_code, 0) << part.err;
    const auto chosen = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(chosen.size(), 2u);
    EXPECT_EQ(chosen[0].frame.frame, 2);
    EXPECT_EQ(chosen[1].frame.frame, 4);
}

TEST_F(TrackCommand, FaultsAreNamedBeforeAnythingIsTracked) {
    scene.write_femur_frames(1, 2);
    scene.write_frame("LAT", 3, Image(72, 70, 1.F));
    scene.write_frame("AP", 3, Image(72, 72, 1.F));
    const std::vector<std::string> frames{"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames",
                                          "LAT=" + folder.path("LAT.%d.tif")};
    const auto message = [&](std::vector<std::string> more, bool with_frames = true) {
        if (with_frames) more.insert(more.begin(), frames.begin(), frames.end());
        const ProgramResult run = run_raylign(scene.femur_alone(more));
        EXPECT_EQ(run.exit_code, 2) << run.err;
        EXPECT_EQ(run.out, "");
        EXPECT_FALSE(std::filesystem::exists(folder.path("track/trajectory.csv")));
        EXPECT_FALSE(std::filesystem::exists(folder.path("track/trajectory.partial.csv")));
        return run.err;
    };
    EXPECT_THAT(message({}), AllOf(HasSubstr("LAT.0003.tif"), HasSubstr("72 x 70"), HasSubstr("72 x 72")));
    std::filesystem::remove(folder.path("LAT.0003.tif"));
    EXPECT_THAT(message({}, false), HasSubstr("has no frames"));
    EXPECT_THAT(message({"--frames", "SIDE=x.%d.tif"}), HasSubstr("SIDE"));
    EXPECT_THAT(message({"--frames", "AP=x.%d.tif"}), HasSubstr("twice"));
    EXPECT_THAT(message({"--first", "5", "--last", "4"}), HasSubstr("first frame"));
    EXPECT_THAT(message({"--first", "7"}), HasSubstr("AP has 1 to 3"));
    EXPECT_THAT(message({"--every", "0"}), HasSubstr("step"));
    EXPECT_THAT(message({"--bone", "tibia=" + folder.path("tibia.mha")}), HasSubstr("contradicts -v"));
    EXPECT_THAT(message({"--start", "tibia=" + folder.path("t.json")}), AllOf(HasSubstr("tibia"), HasSubstr("object")));
    EXPECT_THAT(message({"--joint", "object,tibia"}), HasSubstr("tibia"));
    EXPECT_THAT(message({"--joint", "object,object"}), HasSubstr("two different"));
    EXPECT_THAT(message({"--joint", "object"}), HasSubstr("PROXIMAL,DISTAL"));
    EXPECT_THAT(message({"--cardan", "XYX"}), HasSubstr("ZXY"));
    EXPECT_THAT(message({"--smooth", "-1"}), HasSubstr("none, auto or a strength"));
    EXPECT_THAT(message({"--joint-gap", "-1"}), HasSubstr("in (0, 1000] mm"));
    EXPECT_THAT(message({"--joint-gap", "2"}), HasSubstr("there is one"));
    EXPECT_THAT(message({"--saturation", "0"}), HasSubstr("auto, none or a line integral"));
    EXPECT_THAT(message({"--recover", "auto"}), HasSubstr("none, near or global"));
    EXPECT_THAT(message({"--recover", "wide"}), HasSubstr("wide"));
    EXPECT_THAT(message({"--max-jump", "-2"}), HasSubstr("max_jump_mm"));
    EXPECT_THAT(message({"--axes", "object=" + folder.path("f.json")}), HasSubstr("without --joint"));
    EXPECT_THAT(message({"-o", folder.folder().string() + "/AP.0001.tif"}), Not(HasSubstr("terminate")));
}

TEST_F(TrackCommand, FaultsOfSeveralObjectsAreNamed) {
    const auto message = [&](const std::vector<std::string>& more) {
        const ProgramResult run = run_raylign(scene.both(more));
        EXPECT_EQ(run.exit_code, 2) << run.err;
        return run.err;
    };
    EXPECT_THAT(message({"--bone", "Femur=" + folder.path("tibia.mha")}), HasSubstr("Femur twice"));
    EXPECT_THAT(message({"--bone", "a/b=" + folder.path("tibia.mha")}), HasSubstr("a/b"));
    EXPECT_THAT(message({"--bone", "patella"}), HasSubstr("NAME=VALUE"));
    EXPECT_THAT(message({"--start", "femur=" + folder.path("t.json")}), HasSubstr("femur twice"));
    EXPECT_THAT(message({"--label", "1", "--labels", "x.nii"}), HasSubstr("--label contradicts --bone"));
    EXPECT_THAT(message({"--axes", "femur=" + folder.path("f.json")}), HasSubstr("ct_from_axes"));
    EXPECT_THAT(message({"--joint", "femur,tibia"}), HasSubstr("twice"));
    scene.write_frames(1, 2);
    EXPECT_THAT(message({"--joint-gap", "2"}), HasSubstr("2 views tell depth by themselves"));
}

TEST_F(TrackCommand, BonesAreLabelsByNumberOrName) {
    apps::TrackCommandOptions options;
    options.volume.file = "ct.nii";
    options.volume.labels = "map.nii";
    options.bones = {"left=femur_left", "both=76,sacrum", "one=3"};
    const std::vector<apps::ObjectFlags> objects = apps::objects_of(options);
    ASSERT_EQ(objects.size(), 3);
    EXPECT_THAT(objects[0].volume.label, testing::ElementsAre("femur_left"));
    EXPECT_THAT(objects[1].volume.label, testing::ElementsAre("76", "sacrum"));
    EXPECT_EQ(objects[2].volume.file, "ct.nii");
    options.bones = {"left=" + folder.path("f.json")};  // a file is no label
    EXPECT_THAT(error_of([&] { (void)apps::objects_of(options); }), HasSubstr("contradicts -v"));
}

TEST_F(TrackCommand, OutputsDoNotReplaceInputs) {
    scene.write_femur_frames(1, 1);
    std::filesystem::create_directory(folder.path("track"));
    std::filesystem::rename(folder.path("f.json"), folder.path("track/track.json"));
    auto arguments = scene.femur_alone(
        {"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames", "LAT=" + folder.path("LAT.%d.tif")});
    std::ranges::replace(arguments, folder.path("f.json"), folder.path("track/track.json"));
    const ProgramResult run = run_raylign(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, HasSubstr("would overwrite the input"));
}

TEST_F(TrackCommand, CtrlCBeforeTheFirstFrameLeavesNothing) {
    scene.write_femur_frames(1, 2);
    const auto arguments =
        scene.femur_alone({"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames", "LAT=" + folder.path("LAT.%d.tif"),
                           "--backend", "reference", "--projector", "trilinear", "--step", "0.05"});
    const ProgramResult run = run_raylign_and_signal(arguments, SIGINT, folder.folder() / "track");
    EXPECT_EQ(run.exit_code, 130) << run.err;
    EXPECT_THAT(run.err, HasSubstr("interrupted"));
    EXPECT_FALSE(std::filesystem::exists(folder.path("track")));
}

TEST_F(TrackCommand, ABadFrameCostsThatFrameAlone) {
    constexpr int kFrames = 15;
    scene.write_femur_frames(1, kFrames);
    write_text_file(folder.path("AP.0001.tif"), "no image");
    const std::string whole = read_text(folder.path("LAT.0004.tif"));
    write_text_file(folder.path("LAT.0004.tif"), whole.substr(0, whole.size() / 2));
    write_text_file(folder.path("AP.0008.tif"), "");
    std::filesystem::remove(folder.path("LAT.0010.tif"));
    ASSERT_EQ(::mkfifo(folder.path("LAT.0010.tif").c_str(), 0600), 0);
    std::filesystem::remove(folder.path("AP.0012.tif"));
    const ProgramResult run = run_raylign(scene.femur_alone(
        {"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames", "LAT=" + folder.path("LAT.*.tif")}));
    EXPECT_EQ(run.exit_code, 1) << run.err << run.out;
    for (const char* words :
         {"10 of 15 frames ok", "frame 1: view AP: ", "AP.0001.tif", "frame 4: ", "LAT.0004.tif",
          "frame 8: ", "AP.0008.tif", "frame 10: ", "LAT.0010.tif is a FIFO", "frame 12: view AP has no frame 12"}) {
        EXPECT_THAT(run.out, HasSubstr(words));
    }
    const auto rows = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(rows.size(), 15u);
    for (const TrajectoryRow& row : rows) {
        const int n = row.frame.frame;
        const bool is_bad = n == 1 || n == 4 || n == 8 || n == 10 || n == 12;
        EXPECT_EQ(row.frame.status, is_bad ? TrackStatus::missing : TrackStatus::ok) << n;
    }
    const std::string hashes = read_text(folder.path("track/frames_LAT.sha256"));
    EXPECT_THAT(hashes, HasSubstr(std::string(64, '-') + "  " + folder.path("LAT.0010.tif")));
}

TEST_F(TrackCommand, StepIsOfFramesUnlessTheProjectorHasOne) {
    scene.write_femur_frames(1, 4);
    const std::vector<std::string> frames{"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames",
                                          "LAT=" + folder.path("LAT.%d.tif")};
    auto arguments = frames;
    arguments.insert(arguments.end(), {"--from", "1", "--to", "3", "--step", "2"});
    EXPECT_EQ(run_raylign(scene.femur_alone(arguments)).exit_code, 0);
    const auto rows = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(rows.size(), 2u);
    EXPECT_EQ(rows[1].frame.frame, 3);
    arguments.back() = "0.5";
    EXPECT_THAT(run_raylign(scene.femur_alone(arguments)).err, HasSubstr("a whole number of frames"));
}

}  // namespace
}  // namespace raylign::detail::test
