#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/shared/json_text.h"
#include "apps/shared/line_journal.h"
#include "raylign/tracking.h"

namespace raylign::detail::apps {

/// A frame of an object as it was found, to the last bit, and what it depends on.
struct JournalRow {
    std::string object;
    std::string chain;                ///< what it was tracked from: the key frame, its pose and the direction
    std::optional<int> after;         ///< the frame before it in its chain; none = it is the chain's first
    bool agrees = false;              ///< a chain from a key frame that came back to what was found without it
    std::vector<std::string> sha256;  ///< of its X-rays, one per view; "" where a view lacks it
    TrackFrame frame;
};
[[nodiscard]] std::string journal_line(const JournalRow& row);
/// Throws Error for what is no such line.
[[nodiscard]] JournalRow journal_row(const std::string& line);

/// track.journal: every frame is on the disk before the next is begun, and stays there for runs that correct it.
class FrameJournal {
public:
    static constexpr const char* kName = "track.journal";

    /// `config`: what all frames depend on, JSON in one line; a file of another configuration is renamed to
    /// track.journal.old. Throws Error where another run is at work in `folder`.
    FrameJournal(const std::filesystem::path& folder, const std::string& config);

    /// The row of this chain, found after this frame; null where there is none.
    [[nodiscard]] const JournalRow* find(const std::string& object, int frame, const std::string& chain,
                                         std::optional<int> after) const;
    /// The last row of another chain.
    [[nodiscard]] const JournalRow* other(const std::string& object, int frame, const std::string& chain) const;
    void append(const JournalRow& row);
    [[nodiscard]] bool is_empty() const { return rows_.empty(); }

private:
    LineJournal journal_;
    std::map<std::pair<std::string, int>, std::vector<JournalRow>> rows_;
};

}  // namespace raylign::detail::apps
