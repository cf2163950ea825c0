#pragma once

#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/shared/progress_bar.h"
#include "apps/track/frame_journal.h"
#include "apps/track/inputs.h"
#include "raylign/io/trajectory.h"

namespace raylign::detail::apps {

/// trajectory.partial.csv: the rows so far, for people who want to look while a run goes on. What an earlier run left
/// there is kept as trajectory.partial.old.csv.
class TrackJournal {
public:
    static constexpr const char* kName = "trajectory.partial.csv";
    static constexpr const char* kOldName = "trajectory.partial.old.csv";

    TrackJournal(const std::filesystem::path& folder, const std::vector<std::string>& view_names);
    /// Throws Error, with the system's reason, where the disk is full.
    void append(const TrajectoryRow& row);
    /// The trajectory is in place elsewhere, or nothing was found: the file goes.
    void remove();

private:
    std::filesystem::path file_;
    std::size_t view_count_;
    std::ofstream stream_;
};

/// What came of a run.
struct TrackRecord {
    std::vector<TrajectoryRow> rows;  ///< frame by frame, the objects of each in their order
    std::size_t instants = 0;         ///< frames done
    std::size_t recalled = 0;         ///< rows of these that an earlier run had found
    std::vector<std::string> notes;   ///< of reading
    std::exception_ptr stopped_by;    ///< why it ended early; none = complete
    /// Per view its files, each once, hashed when they were read; dashes for one that cannot be.
    std::vector<std::vector<HashedFile>> frame_hashes;
    double hash_s = 0;
    double read_s = 0, track_s = 0;  ///< wall time of reading frames and of registering
};

/// The rows of one object.
[[nodiscard]] std::vector<const TrackFrame*> frames_of(const std::vector<TrajectoryRow>& rows,
                                                       const std::string& object);

/// Where the rows of a run are kept while it goes on.
struct TrackJournals {
    TrackJournal& table;
    FrameJournal& frames;
};

/// Tracks all objects through all frames: each from its start in the first frame and anew from each of its key frames,
/// forwards, then backwards from key frames. A chain from a key frame ends where it comes back, within 0.1 mm at the
/// rim and ok, to what was found without it. Frames that the journal has are not tracked again. Errors after the first
/// frame, and a stop, end the run early: what was found until then is in the record and in the journal.
[[nodiscard]] TrackRecord run_track(const TrackInputs& inputs, const TrackOptions& options, Backend& backend,
                                    ProgressBar::Show show, const TrackJournals& journals, const RunControl& control);

/// "[####----]  40%  frame 12 (12 of 30)  radius ok  8.1 frames/s  3 s left"; `tracked`: those of `done` that took the
/// time.
[[nodiscard]] std::string track_progress_line(std::size_t done, std::size_t all, std::size_t tracked,
                                              const TrajectoryRow& last, double elapsed_s);

}  // namespace raylign::detail::apps
