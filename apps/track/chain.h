#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/track/frame_journal.h"
#include "apps/track/inputs.h"
#include "core/registration/object/pose_space.h"
#include "core/tracking/company.h"
#include "raylign/io/frames.h"
#include "raylign/registration.h"

namespace raylign::detail::apps {

enum class Direction { forwards, backwards };

/// A frame as one object's tracker is shown it.
struct Sight {
    std::string gap;  ///< why there are no images; "" = there are
    ViewsFor views;
};

/// Frames of one object in turn from a key frame: a tracker, and the rows of the journal that it need not find again.
class Chain {
public:
    struct Key {
        int frame = 0;
        RigidTransform world_from_ct;
        bool is_correction = false;  ///< ends where it comes back to what was found without it
    };
    Chain(const TrackObject& object, const Key& key, Direction direction, const TrackOptions& options, Backend& backend,
          FrameJournal& journal);

    /// The row of the next frame. `look` is asked only where the frame has to be tracked. Throws Interrupted where
    /// that was stopped: a frame that was not finished is none. `sha256`: of its X-rays.
    [[nodiscard]] TrackFrame next(int frame, const std::vector<std::string>& sha256, const std::function<Sight()>& look,
                                  const RunControl& control);
    /// What the next frame, of this number, is expected to show of the object.
    [[nodiscard]] Expectation expectation(int frame) const;
    /// Begins with a frame that another chain found: the key frame itself, for the way backwards.
    void begin_with(const TrackFrame& frame);
    /// It has come back to what was found without it.
    [[nodiscard]] bool has_agreed() const { return agreed_; }
    [[nodiscard]] bool was_recalled() const { return was_recalled_; }

private:
    [[nodiscard]] const JournalRow* known_row(int frame, const std::vector<std::string>& sha256) const;
    [[nodiscard]] bool comes_back(const TrackFrame& found) const;
    [[nodiscard]] TrackFrame in_time(TrackFrame frame) const;

    const TrackObject& object_;
    Key key_;
    int sign_;
    std::string name_;
    Tracker tracker_;
    Prospect prospect_;
    FrameJournal& journal_;
    ObjectExtent extent_;
    std::optional<int> last_;
    bool agreed_ = false, was_recalled_ = false;
    bool is_new_ = false;  ///< a frame was tracked: what the journal has of later ones followed from another
};

}  // namespace raylign::detail::apps
