#include "apps/track/run.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <future>
#include <system_error>

#include "apps/shared/append.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/lines.h"
#include "apps/shared/saturation.h"
#include "apps/track/chain.h"
#include "core/base/clock.h"
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

std::string track_progress_line(std::size_t done, std::size_t all, std::size_t tracked, const TrajectoryRow& last,
                                double elapsed_s) {
    const double share = all > 0 ? static_cast<double>(done) / static_cast<double>(all) : 1;
    const double rate = tracked > 0 ? static_cast<double>(tracked) / std::max(elapsed_s, 1e-9) : 0;
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

/// The SHA-256 of a frame's files, one per view; "" where a view lacks it.
std::vector<std::string> hash_frames(const FrameSet& frames, TrackRecord& record) {
    const auto begin = Clock::now();
    std::vector<std::string> all(frames.files.size());
    record.frame_hashes.resize(frames.files.size());
    for (std::size_t v = 0; v < frames.files.size(); ++v) {
        if (!frames.files[v]) continue;
        std::vector<HashedFile>& hashed = record.frame_hashes[v];
        const std::string name = frames.files[v]->file.string();
        if (hashed.empty() || hashed.back().path != name) hashed.push_back({name, hash_or_dashes(name)});
        all[v] = hashed.back().sha256;
    }
    record.hash_s += seconds_since(begin);
    return all;
}

/// Reads an instant when it is needed, and the one after it while that one is worked on. What is settled by a view's
/// first frame is settled by the sequence's first, no matter where this run begins.
class LazyReader {
public:
    LazyReader(const TrackInputs& inputs, TrackRecord& record)
        : inputs_(inputs), reader_(inputs.views), record_(record) {}

    const Instant& read(std::size_t at) {
        if (at_ == at) return instant_;
        const auto begin = Clock::now();
        std::optional<Instant> ahead;
        if (ahead_.valid()) ahead = ahead_.get();  // one reader, one reading at a time
        for (std::size_t i = 0; !is_settled_ && i < at; ++i) {
            instant_ = reader_.read(inputs_.frames[i]);
            settle();
        }
        instant_ = ahead && ahead_at_ == at ? std::move(*ahead) : reader_.read(inputs_.frames[at]);
        settle();
        for (std::size_t v = 0; v < std::min(detectors_.size(), instant_.views.size()); ++v) {
            instant_.views[v].ceiling = detectors_[v].ceiling;
            instant_.views[v].by_transmission = detectors_[v].by_transmission;
        }
        const bool is_backwards = at_ && at < *at_;
        at_ = at;
        if (!is_backwards || at > 0) read_ahead(is_backwards ? at - 1 : at + 1);
        record_.read_s += seconds_since(begin);
        return instant_;
    }
    [[nodiscard]] std::vector<std::string> notes() const {
        if (ahead_.valid()) ahead_.wait();
        std::vector<std::string> all = reader_.notes();
        append(all, notes_);
        return all;
    }

private:
    void read_ahead(std::size_t at) {
        if (!is_settled_ || at >= inputs_.frames.size()) return;
        ahead_at_ = at;
        ahead_ = std::async(std::launch::async, [this, at] { return reader_.read(inputs_.frames[at]); });
    }

    /// By the first instant with all of its images.
    void settle() {
        if (is_settled_ || !instant_.gap.empty()) return;
        is_settled_ = true;
        notes_ = settle_saturation(inputs_.saturation, inputs_.has_metal, instant_.views);
        for (const View& view : instant_.views) detectors_.push_back({view.ceiling, view.by_transmission});
    }

    const TrackInputs& inputs_;
    InstantReader reader_;
    TrackRecord& record_;
    Instant instant_;
    std::optional<std::size_t> at_;
    bool is_settled_ = false;
    struct Detector {
        double ceiling;
        bool by_transmission;
    };
    std::vector<Detector> detectors_;
    std::vector<std::string> notes_;
    std::size_t ahead_at_ = 0;
    std::future<Instant> ahead_;  ///< the last member: its end waits for the reading, which needs the others
};

/// One run through all frames, forwards and then backwards.
class TrackPasses {
public:
    TrackPasses(const TrackInputs& inputs, const TrackOptions& options, Backend& backend, ProgressBar::Show show,
                const TrackJournals& journals, const RunControl& control, TrackRecord& record)
        : inputs_(inputs),
          options_(options),
          backend_(backend),
          journals_(journals),
          control_(control),
          record_(record),
          reader_(inputs, record),
          bar_(show),
          found_(inputs.frames.size(), std::vector<std::optional<TrackFrame>>(inputs.objects.size())) {
        if (!inputs.is_together) return;
        std::vector<const Volume*> volumes;
        for (const TrackObject& object : inputs.objects) volumes.push_back(&object.volume);
        company_.emplace(volumes, options, backend);
    }

    void run() {
        hashes_.resize(inputs_.frames.size());
        forwards();
        for (std::size_t o = 0; o < inputs_.objects.size(); ++o) backwards(o);
    }

    /// The frames that all objects have a row for go to the record.
    void close() {
        for (std::size_t i = 0; i < found_.size(); ++i) {
            if (!std::ranges::all_of(found_[i], [](const auto& row) { return row.has_value(); })) continue;
            ++record_.instants;
            for (std::size_t o = 0; o < found_[i].size(); ++o) {
                record_.rows.push_back({inputs_.objects[o].name, *found_[i][o]});
            }
        }
        record_.notes = reader_.notes();
    }

private:
    void forwards() {
        std::vector<std::optional<Chain>> chains(inputs_.objects.size());
        for (std::size_t i = 0; i < inputs_.frames.size(); ++i) {
            stop_if_asked();
            hashes_[i] = hash_frames(inputs_.frames[i], record_);
            std::vector<std::optional<TrackFrame>> rows(chains.size());
            std::size_t recalled = 0;
            for (std::size_t o = 0; o < chains.size(); ++o) begin_chain(o, inputs_.frames[i].number, chains[o]);
            const std::vector<Expectation> expected = expectations(chains, inputs_.frames[i].number);
            has_met_ = false;
            for (std::size_t o = 0; o < chains.size(); ++o) {
                if (!chains[o]) continue;
                rows[o] = step(*chains[o], i, o, expected);
                recalled += chains[o]->was_recalled() ? 1 : 0;
            }
            take(i, std::move(rows), recalled);
        }
    }

    /// At a key frame.
    void begin_chain(std::size_t o, int number, std::optional<Chain>& chain) {
        const TrackObject& object = inputs_.objects[o];
        const auto key = object.keys.find(number);
        if (key == object.keys.end()) return;
        chain.reset();  // its resident volume makes room first
        chain.emplace(object, Chain::Key{key->first, key->second.world_from_ct, key->second.is_correction},
                      Direction::forwards, options_, backend_, journals_.frames);
    }

    /// What the frames before say of all objects in the next: whether rows are found or recalled, they say the same.
    static std::vector<Expectation> expectations(const std::vector<std::optional<Chain>>& chains, int frame) {
        std::vector<Expectation> expected(chains.size());
        for (std::size_t o = 0; o < chains.size(); ++o) {
            if (chains[o]) expected[o] = chains[o]->expectation(frame);
        }
        return expected;
    }

    /// On the way backwards the others are where they were found.
    std::vector<Expectation> expectations(const Chain& chain, std::size_t object, std::size_t at) const {
        std::vector<Expectation> expected(inputs_.objects.size());
        for (std::size_t o = 0; o < expected.size(); ++o) {
            const std::optional<TrackFrame>& found = found_[at][o];
            const bool has_pose = found && (found->status == TrackStatus::ok || found->status == TrackStatus::doubtful);
            if (has_pose) expected[o] = {Whereabouts::settled, found->world_from_ct};
        }
        expected[object] = chain.expectation(inputs_.frames[at].number);
        return expected;
    }

    /// From each key frame to the one before, or to where it comes back to what was found forwards.
    void backwards(std::size_t object) {
        std::size_t begin = 0;
        for (const auto& [number, key] : inputs_.objects[object].keys) {
            const auto at = static_cast<std::size_t>(std::ranges::find(inputs_.frames, number, &FrameSet::number) -
                                                     inputs_.frames.begin());
            if (key.is_correction && at > begin) {
                Chain chain(inputs_.objects[object], {number, key.world_from_ct, true}, Direction::backwards, options_,
                            backend_, journals_.frames);
                chain.begin_with(*found_[at][object]);
                for (std::size_t i = at; i-- > begin && !chain.has_agreed();) {
                    stop_if_asked();
                    std::vector<std::optional<TrackFrame>> rows(inputs_.objects.size());
                    has_met_ = false;
                    rows[object] = step(chain, i, object, expectations(chain, object, i));
                    take(i, std::move(rows), chain.was_recalled() ? 1 : 0);
                }
            }
            begin = at + 1;
        }
    }

    /// The frame as it is, or less what the other objects show.
    Sight look(std::size_t at, std::size_t object, const std::vector<Expectation>& expected) {
        const Instant& instant = reader_.read(at);
        if (!instant.gap.empty()) return {instant.gap, {}};
        if (!company_) return {"", [&](std::optional<int>) { return instant.views; }};
        if (!has_met_) company_->meet(instant.views, expected, control_);
        has_met_ = true;
        return {"", [this, &instant, object](std::optional<int> coarser_by) {
                    return company_->remainder(instant.views, object, coarser_by);
                }};
    }

    TrackFrame step(Chain& chain, std::size_t at, std::size_t object, const std::vector<Expectation>& expected) {
        const auto begin = Clock::now();
        const double before_s = record_.read_s;
        TrackFrame frame = chain.next(
            inputs_.frames[at].number, hashes_[at], [&] { return look(at, object, expected); }, control_);
        record_.track_s += seconds_since(begin) - (record_.read_s - before_s);
        return frame;
    }

    /// Rows count once their frame is whole: where a run ends within one, it is tracked again.
    void take(std::size_t at, std::vector<std::optional<TrackFrame>> rows, std::size_t recalled) {
        std::size_t count = 0;
        for (std::size_t o = 0; o < rows.size(); ++o) {
            if (!rows[o]) continue;
            ++count;
            journals_.table.append({inputs_.objects[o].name, *rows[o]});
            last_ = {inputs_.objects[o].name, *rows[o]};
            found_[at][o] = std::move(rows[o]);
        }
        record_.recalled += recalled;
        ++done_;
        if (recalled < count) ++tracked_;
        if (count > 0) {
            bar_.draw(track_progress_line(std::min(done_, inputs_.frames.size()), inputs_.frames.size(), tracked_,
                                          last_, record_.read_s + record_.track_s));
        }
    }

    void stop_if_asked() const {
        if (control_.stop.stop_requested()) throw Interrupted("interrupted: no file was changed");
    }

    const TrackInputs& inputs_;
    const TrackOptions& options_;
    Backend& backend_;
    const TrackJournals& journals_;
    const RunControl& control_;
    TrackRecord& record_;
    LazyReader reader_;
    std::optional<Company> company_;
    bool has_met_ = false;  ///< the company, in the frame that is worked on
    ProgressBar bar_;
    std::vector<std::vector<std::optional<TrackFrame>>> found_;  ///< [instant][object]
    std::vector<std::vector<std::string>> hashes_;               ///< [instant][view]
    TrajectoryRow last_;
    std::size_t done_ = 0, tracked_ = 0;
};

}  // namespace

TrackRecord run_track(const TrackInputs& inputs, const TrackOptions& options, Backend& backend, ProgressBar::Show show,
                      const TrackJournals& journals, const RunControl& control) {
    TrackRecord record;
    TrackPasses passes(inputs, options, backend, show, journals, control, record);
    try {
        passes.run();
    } catch (const std::exception&) {  // whatever it is, what was found is kept
        record.stopped_by = std::current_exception();
    }
    passes.close();
    if (record.stopped_by && record.rows.empty()) std::rethrow_exception(record.stopped_by);
    return record;
}

}  // namespace raylign::detail::apps
