#include "apps/track/run.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "apps/shared/clock.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/lines.h"
#include "core/base/error.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {

TrackJournal::TrackJournal(const std::filesystem::path& folder, const std::vector<std::string>& view_names)
    : file_(folder / kName), view_count_(view_names.size()) {
    std::error_code ignored;  // there may be none
    std::filesystem::rename(file_, folder / kOldName, ignored);
    stream_.open(file_, std::ios::binary | std::ios::trunc);
    if (!stream_) throw Error(file_.string() + " cannot be written: " + std::generic_category().message(errno));
    stream_ << trajectory_header(view_names) << std::flush;
}

void TrackJournal::append(const TrajectoryRow& row) {
    stream_ << trajectory_line(row, view_count_) << std::flush;
    if (!stream_) throw Error(file_.string() + " cannot be written: " + std::generic_category().message(errno));
}

void TrackJournal::remove() {
    stream_.close();
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
}

std::string track_progress_line(std::size_t done, std::size_t all, const TrajectoryRow& last, double elapsed_s) {
    const double share = all > 0 ? static_cast<double>(done) / static_cast<double>(all) : 1;
    const double rate = done > 0 ? static_cast<double>(done) / std::max(elapsed_s, 1e-9) : 0;
    const double left_s = rate > 0 ? static_cast<double>(all - done) / rate : 0;
    return bar_text(share) + format(" %3.0f%%  frame %d (%zu of %zu)  ", 100 * share, last.frame.frame, done, all) +
           last.object + " " + std::string(status_name(last.frame.status)) +
           format("  %.1f frames/s  %.0f s left", rate, std::ceil(left_s));
}

std::vector<const TrackFrame*> frames_of(const std::vector<TrajectoryRow>& rows, const std::string& object) {
    std::vector<const TrackFrame*> frames;
    for (const TrajectoryRow& row : rows) {
        if (row.object == object) frames.push_back(&row.frame);
    }
    return frames;
}

namespace {

constexpr std::size_t kSha256Digits = 64;

/// A frame that cannot be read is a gap and gets dashes.
std::string hash_or_dashes(const std::filesystem::path& file) {
    try {
        return sha256_of_file(file);
    } catch (const Error&) {
        return std::string(kSha256Digits, '-');
    }
}

void hash_frames(const FrameSet& frames, TrackRecord& record) {
    const auto begin = Clock::now();
    record.frame_hashes.resize(frames.files.size());
    for (std::size_t v = 0; v < frames.files.size(); ++v) {
        if (!frames.files[v]) continue;
        std::vector<HashedFile>& hashed = record.frame_hashes[v];
        const std::string name = frames.files[v]->file.string();
        if (hashed.empty() || hashed.back().path != name) hashed.push_back({name, hash_or_dashes(name)});
    }
    record.hash_s += seconds_since(begin);
}

}  // namespace

TrackRecord run_track(const TrackInputs& inputs, const TrackOptions& options, Backend& backend, ProgressBar::Show show,
                      TrackJournal& journal, const RunControl& control) {
    TrackRecord record;
    const auto stop_if_asked = [&control] {
        if (control.stop.stop_requested()) throw Interrupted("interrupted: no file was changed");
    };
    std::vector<Tracker> trackers;
    trackers.reserve(inputs.objects.size());
    for (const TrackObject& object : inputs.objects) {
        trackers.emplace_back(object.volume, object.start_world_from_ct, options, backend);
    }
    InstantReader reader(inputs.views);
    ProgressBar bar(show);
    const auto begin = Clock::now();
    try {
        for (const FrameSet& set : inputs.frames) {
            stop_if_asked();
            const auto read_begin = Clock::now();
            const Instant instant = reader.read(set);
            record.read_s += seconds_since(read_begin);
            hash_frames(set, record);
            const auto track_begin = Clock::now();
            std::vector<TrajectoryRow> rows;
            for (std::size_t i = 0; i < trackers.size(); ++i) {
                rows.push_back({inputs.objects[i].name, instant.gap.empty()
                                                            ? trackers[i].feed(set.number, instant.views, control)
                                                            : trackers[i].skip(set.number, instant.gap)});
                stop_if_asked();  // a frame that was not finished is none
            }
            record.track_s += seconds_since(track_begin);
            for (TrajectoryRow& row : rows) {
                journal.append(row);
                record.rows.push_back(std::move(row));
            }
            ++record.instants;
            bar.draw(
                track_progress_line(record.instants, inputs.frames.size(), record.rows.back(), seconds_since(begin)));
        }
    } catch (const std::exception&) {  // whatever it is, what was found is kept
        if (record.rows.empty()) throw;
        record.stopped_by = std::current_exception();
    }
    record.notes = reader.notes();
    return record;
}

}  // namespace raylign::detail::apps
