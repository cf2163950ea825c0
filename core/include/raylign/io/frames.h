#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "raylign/io/frame_files.h"
#include "raylign/io/views.h"

namespace raylign {
namespace detail {
struct PixelMap;
}

/// The frames of all views with one number.
struct FrameSet {
    int number = 0;
    std::vector<std::optional<FrameFile>> files;  ///< one per view; none where it has no such frame
};

/// Which frames of a sequence.
struct FrameRange {
    std::optional<int> first, last;  ///< numbers, both included; none = the sequence's own
    int step = 1;                    ///< take the numbers first, first + step, ...; at least 1
};

/// The frames that any view has in the range, by number, and those that none has in between: in steps that meet all
/// numbers, unless more would be lacking than are there (the numbers then count no frames). Throws Error for a bad
/// range, and where no number of the range is in all views: such lists do not belong together.
[[nodiscard]] std::vector<FrameSet> pair_frames(const ViewsFile& views, const FrameRange& range);

/// Throws Error, naming the file, unless every file has the size of its view's camera. Reads headers only.
void check_frame_sizes(const ViewsFile& views, const std::vector<FrameSet>& frames);

/// All views at one instant.
struct Instant {
    std::vector<View> views;
    std::string
        gap;  ///< why there are no images: a frame is missing, empty, unreadable or of another size; "" = there are
};

/// Reads instants as read_views(ReadImages::required) would read one, image by image: turned, masked, made line
/// integrals. What is settled automatically is settled for each frame, except the polarity: that of a view's first
/// frame holds for all, as a detector does not change it. One reader, one thread.
class InstantReader {
public:
    /// `views`: read with ReadImages::frames.
    explicit InstantReader(ViewsFile views);

    /// Throws nothing for files that cannot be read: a bad frame is a gap and says why.
    [[nodiscard]] Instant read(const FrameSet& frames);
    /// What was decided on the first frame of each view, "AP: ...".
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

private:
    [[nodiscard]] View make_view(std::size_t view, const FrameFile& file, RawXray raw);

    ViewsFile views_;
    std::vector<FrameReader> readers_;
    std::vector<bool> is_settled_;
    std::vector<std::shared_ptr<const detail::PixelMap>> maps_;  ///< that undo distortion; null where there is none
    std::vector<std::string> notes_;
};

}  // namespace raylign
