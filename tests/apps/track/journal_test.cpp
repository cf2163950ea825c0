#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <sstream>

#include "apps/track/options.h"
#include "apps/track/run.h"
#include "raylign/backends.h"
#include "raylign/io/pose.h"
#include "raylign/io/trajectory.h"
#include "tests/apps/track/track_case.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// Eight rows with the same bits.
void expect_alike(const std::vector<TrajectoryRow>& once, const std::vector<TrajectoryRow>& twice) {
    ASSERT_EQ(once.size(), 8U);
    ASSERT_EQ(twice.size(), 8U);
    for (std::size_t i = 0; i < once.size(); ++i) {
        EXPECT_EQ(once[i].frame.world_from_ct.rotation, twice[i].frame.world_from_ct.rotation) << i;
        EXPECT_EQ(once[i].frame.world_from_ct.translation_mm, twice[i].frame.world_from_ct.translation_mm) << i;
        EXPECT_EQ(once[i].frame.cost, twice[i].frame.cost) << i;
        EXPECT_EQ(once[i].frame.status, twice[i].frame.status) << i;
    }
}

/// Runs that end early, and runs that go on from what others left.
class TrackJournalFile : public testing::Test {
protected:
    TestFolder folder;
    TrackCase scene{folder};
};

TEST_F(TrackJournalFile, AStoppedRunKeepsWhatItHad) {
    constexpr std::size_t kFrames = 4;
    scene.write_femur_frames(1, kFrames);
    apps::TrackCommandOptions options;
    options.volume.file = folder.path("femur.mha");
    options.volume.attenuation = true;
    options.views.files = {folder.path("geometry.json")};
    options.frames = {"AP=" + folder.path("AP.%d.tif"), "LAT=" + folder.path("LAT.%d.tif")};
    options.starts = {folder.path("f.json")};
    const apps::TrackInputs inputs = apps::read_track_inputs(options);
    std::filesystem::create_directory(folder.path("track"));
    write_text_file(folder.path("track/trajectory.partial.csv"), "of an earlier run");
    apps::TrackJournal journal(folder.path("track"), inputs.view_names());
    apps::FrameJournal frames(folder.path("track"), "{}");
    EXPECT_EQ(read_text(folder.path("track/trajectory.partial.old.csv")), "of an earlier run");
    const TrackOptions track = apps::track_options(options, 1);
    const auto partial = [&] { return read_trajectory(folder.path("track/trajectory.partial.csv")); };
    StopSource source;
    const RunControl control{.stop = source.token(), .meanwhile = [&] {
                                 if (partial().size() == 2) source.request_stop();  // in the midst of the third frame
                             }};
    const auto backend = create_backend("cpu").backend;
    const apps::TrackRecord record =
        apps::run_track(inputs, track, *backend, apps::ProgressBar::Show::never, {journal, frames}, control);
    EXPECT_EQ(record.instants, 2u);
    EXPECT_EQ(record.rows.size(), 2u);
    EXPECT_TRUE(record.stopped_by);
    ASSERT_EQ(partial().size(), 2u) << "on the disk while the run goes on";
    EXPECT_EQ(partial()[1].frame.frame, 2);
    journal.remove();
    EXPECT_FALSE(std::filesystem::exists(folder.path("track/trajectory.partial.csv")));
}

TEST_F(TrackJournalFile, SignalsKeepTheFinishedFrames) {
    scene.write_femur_frames(1, 12);
    const auto arguments = scene.femur_alone({"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames",
                                              "LAT=" + folder.path("LAT.%d.tif"), "--backend", "reference"});
    const auto has_two_rows = [&] {
        const std::string partial = read_text(folder.path("track/trajectory.partial.csv"));
        return std::ranges::count(partial, '\n') > 2;
    };
    const ProgramResult run = run_raylign_and(arguments, has_two_rows, [](int process) { ::kill(process, SIGTERM); });
    EXPECT_EQ(run.exit_code, 130) << run.err;
    EXPECT_THAT(run.err, HasSubstr("interrupted after"));
    EXPECT_GE(read_trajectory(folder.path("track/trajectory.csv")).size(), 2u);
    EXPECT_LT(read_trajectory(folder.path("track/trajectory.csv")).size(), 12u);
    for (const std::string& name : names_in(folder.folder() / "track")) EXPECT_NE(name.front(), '.') << name;
}

TEST_F(TrackJournalFile, TheSameCommandGoesOnAfterAKillWithTheSameBits) {
    scene.write_femur_frames(1, 8);
    const std::vector<std::string> frames{"--frames",  "AP=" + folder.path("AP.%d.tif"),
                                          "--frames",  "LAT=" + folder.path("LAT.%d.tif"),
                                          "--backend", "reference"};
    const auto arguments = scene.femur_alone(frames);
    auto whole = arguments;
    std::ranges::replace(whole, folder.path("track"), folder.path("whole"));
    EXPECT_EQ(run_raylign(whole).exit_code, 0);
    const auto lines = [&] {
        const std::string journal = read_text(folder.path("track/track.journal"));
        return std::ranges::count(journal, '\n');
    };
    (void)run_raylign_and(
        arguments, [&] { return lines() > 3; }, [](int process) { ::kill(process, SIGKILL); });
    const auto kept = lines();
    EXPECT_GT(kept, 3);
    EXPECT_LT(kept, 9);
    EXPECT_FALSE(std::filesystem::exists(folder.path("track/trajectory.csv")));
    const std::string torn = read_text(folder.path("track/track.journal")) + "{\"object\": \"obj";
    write_text_file(folder.path("track/track.journal"), torn);
    const ProgramResult rest = run_raylign(arguments);
    EXPECT_EQ(rest.exit_code, 0) << rest.err;
    EXPECT_THAT(rest.out, HasSubstr(std::to_string(kept - 1) + " of 8 rows are from an earlier run"));
    EXPECT_EQ(lines(), 9) << "a line of settings and one a frame: none was tracked twice";
    expect_alike(read_trajectory(folder.path("whole/trajectory.csv")),
                 read_trajectory(folder.path("track/trajectory.csv")));
    auto other = arguments;
    other.insert(other.end(), {"--levels", "2"});
    EXPECT_THAT(run_raylign(other).out, Not(HasSubstr("earlier run"))) << "other options: nothing is taken over";
    EXPECT_TRUE(std::filesystem::exists(folder.path("track/track.journal.old")));
}

TEST_F(TrackJournalFile, BonesTogetherGoOnInTheMidstOfAFrameWithTheSameBits) {
    scene.write_frames(1, 4);
    EXPECT_EQ(run_raylign(scene.both()).exit_code, 0);
    EXPECT_THAT(read_text(folder.path("track/track.json")), HasSubstr("\"together\": true"));
    const auto once = read_trajectory(folder.path("track/trajectory.csv"));
    std::istringstream lines(read_text(folder.path("track/track.journal")));
    std::string kept;
    for (int i = 0; i < 6; ++i) {  // settings, two frames of both, and the third of the first
        std::string line;
        std::getline(lines, line);
        kept += line + "\n";
    }
    write_text_file(folder.path("track/track.journal"), kept);
    const ProgramResult rest = run_raylign(scene.both());
    EXPECT_THAT(rest.out, HasSubstr("5 of 8 rows are from an earlier run"));
    expect_alike(once, read_trajectory(folder.path("track/trajectory.csv")));
    const ProgramResult alone = run_raylign(scene.both({"--alone"}));
    EXPECT_THAT(alone.out, Not(HasSubstr("earlier run"))) << "other settings";
    EXPECT_THAT(read_text(folder.path("track/track.json")), HasSubstr("\"together\": false"));
}

TEST_F(TrackJournalFile, TwoRunsInOneFolderAreRefused) {
    scene.write_femur_frames(1, 1);
    std::filesystem::create_directory(folder.path("track"));
    const apps::FrameJournal other(folder.path("track"), "{}");
    const ProgramResult run = run_raylign(scene.femur_alone(
        {"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames", "LAT=" + folder.path("LAT.%d.tif")}));
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, HasSubstr("another run is working on this track"));
}

TEST_F(TrackJournalFile, AKeyFrameIsTrackedFromBothWays) {
    constexpr int kFrames = 9, kKey = 5;
    scene.write_femur_frames(1, kFrames);
    write_pose(folder.path("k.json"), RigidTransform::translate({1, -1, 1}) * TrackCase::femur(kKey));
    const std::vector<std::string> frames{"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames",
                                          "LAT=" + folder.path("LAT.%d.tif")};
    auto alone = scene.femur_alone(frames);
    const auto start = std::ranges::find(alone, "--start");
    alone.erase(start, start + 2);
    alone.insert(alone.end(), {"--keyframe", "5=" + folder.path("k.json")});
    const ProgramResult run = run_raylign(alone);
    EXPECT_EQ(run.exit_code, 0) << run.err << run.out;
    const auto rows = read_trajectory(folder.path("track/trajectory.csv"));
    ASSERT_EQ(rows.size(), static_cast<std::size_t>(kFrames));
    for (const TrajectoryRow& row : rows) {
        EXPECT_EQ(row.frame.status, TrackStatus::ok) << row.frame.frame;
        EXPECT_LT(centre_error_mm(row, TrackCase::femur(row.frame.frame), TrackCase::kFemurCentre), 0.4);
    }
    const auto lines = [&] {
        const std::string journal = read_text(folder.path("track/track.journal"));
        return std::ranges::count(journal, '\n');
    };
    EXPECT_EQ(lines(), 1 + kFrames);
    // A correction of a frame: its neighbours are found where they were, and the rest is not tracked again.
    write_pose(folder.path("k2.json"), TrackCase::femur(7));
    alone.insert(alone.end(), {"--keyframe", "7=" + folder.path("k2.json")});
    const ProgramResult corrected = run_raylign(alone);
    EXPECT_EQ(corrected.exit_code, 0) << corrected.err;
    EXPECT_LE(lines(), 1 + kFrames + 4) << "frame 7, one after it and one before";
    EXPECT_GT(lines(), 1 + kFrames);
    EXPECT_EQ(read_trajectory(folder.path("track/trajectory.csv")).size(), static_cast<std::size_t>(kFrames));
}

TEST_F(TrackJournalFile, KeyFramesThatAreNoneAreNamed) {
    scene.write_femur_frames(1, 2);
    const auto message = [&](const std::string& key) {
        const ProgramResult run =
            run_raylign(scene.femur_alone({"--frames", "AP=" + folder.path("AP.%d.tif"), "--frames",
                                           "LAT=" + folder.path("LAT.%d.tif"), "--keyframe", key}));
        EXPECT_EQ(run.exit_code, 2) << run.err;
        return run.err;
    };
    EXPECT_THAT(message("1"), HasSubstr("[NAME:]N=FILE"));
    EXPECT_THAT(message("x=" + folder.path("f.json")), HasSubstr("a whole number"));
    EXPECT_THAT(message("7=" + folder.path("f.json")), HasSubstr("one of those that are tracked"));
    EXPECT_THAT(message("tibia:1=" + folder.path("f.json")), AllOf(HasSubstr("tibia"), HasSubstr("object")));
}

TEST(TrackProgress, TellsRateAndTimeLeft) {
    const TrajectoryRow row{"radius", {.frame = 12, .status = TrackStatus::ok}};
    const std::string line = apps::track_progress_line(10, 30, 10, row, 5);
    EXPECT_THAT(line, AllOf(HasSubstr("33%"), HasSubstr("frame 12 (10 of 30)"), HasSubstr("radius ok"),
                            HasSubstr("2.0 frames/s"), HasSubstr("10 s left")));
}

}  // namespace
}  // namespace raylign::detail::test
