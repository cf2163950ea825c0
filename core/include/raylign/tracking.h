#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/registration.h"

namespace raylign {

/// How an object is followed.
struct TrackOptions {
    /// The first frame is registered by these as they stand; later ones without a search, as the content that the first
    /// was found to be.
    RegistrationOptions registration;
    /// The widest search that may recover a frame: none, near (20 mm and 30 degrees, then 40 mm and 60 degrees around
    /// the prediction) or global; automatic = global. Needs a backend with derivatives, as all searches do.
    Search recovery = Search::automatic;
    /// Largest believable distance from the prediction, at the rim, in (0, 1000]; default: by itself (Tracker).
    std::optional<double> max_jump_mm;
    double frame_step = 1;  ///< numbers between two frames that follow each other; positive
    bool quick = true;      ///< find frames the quick way where that may be (Tracker)
    /// One view: by how much depth, along its line of sight, changes from frame to frame, as a standard deviation in
    /// (0, 1000] mm. Then where the last frame lay counts beside the image, by what both are expected to be off, unless
    /// they contradict each other. Default: depth is what the image says of it.
    std::optional<double> depth_change_mm;

    /// What is wrong with them; "" = nothing.
    [[nodiscard]] std::string problem() const;
};

/// What became of a frame.
enum class TrackStatus {
    ok,        ///< by the verdict, and in keeping with the frames before
    doubtful,  ///< a pose with reasons to look at it; the track goes on from it
    lost,      ///< no believable pose; the track goes on from the frames before
    missing,   ///< no images: no pose
    stopped,   ///< the caller stopped it: the best pose until then; for the tracker the frame was not there
};
[[nodiscard]] std::string_view status_name(TrackStatus status);  ///< "ok", "doubtful", "lost", "missing", "stopped"

/// One frame of one object.
struct TrackFrame {
    int frame = 0;  ///< its number
    TrackStatus status = TrackStatus::missing;
    RigidTransform world_from_ct;            ///< lost: the best that was found; missing: the prediction
    RigidTransform predicted_world_from_ct;  ///< where it was sought first
    double jump_mm = 0;                      ///< from the prediction, at the object's rim
    double cost = 0;
    std::vector<double> view_costs;
    double expected_error_mm = 0;  ///< Confidence::rim_mm; 0 = not estimated
    /// With one view: Confidence::in_plane_mm and in_depth_mm; 0 with more. Of any: its rotation_deg.
    double expected_in_plane_mm = 0, expected_in_depth_mm = 0, expected_turn_deg = 0;
    Search searched = Search::none;        ///< the widest search that ran for it
    bool recovered = false;                ///< the pose is a search's, not the extrapolated start's
    bool jumped = false;                   ///< farther from the prediction than is believed without a search
    Content content = Content::automatic;  ///< what it was registered as; automatic where that was doubtful
    bool quick = false;                    ///< found on one level alone; cost and view_costs are those of that level
    std::vector<double> quick_view_costs;  ///< of the views on that level, wherever it was gone: empty = it was not
    bool quick_agrees = false;             ///< registered in full as well, and both ways end alike
    double quick_error_ratio = 1;          ///< there: by how much more the full way expects to be off; at least 1
    std::vector<std::string> reasons;      ///< why not ok, in words for people
    double time_s = 0;
};

/// A frame's views, made when they are needed: `coarser_by` none: as they are; else for the quick way, whose one level
/// is that much coarser than the finest that the prediction calls for (less where there are no such levels): whatever
/// is finer than its pixels goes unseen. Each call gives the same X-rays, as finely as they will be looked at.
using ViewsFor = std::function<std::vector<View>(std::optional<int> coarser_by)>;

/// Follows one object through frames that come one at a time, in order.
///
/// Each frame starts from where the last tracked ones point to and is registered without a search. It is not believed
/// where the verdict says no, where it lies farther from the prediction than max_jump_mm (by itself: 20 mm at the rim
/// until three jumps and a velocity are known, then 3 mm + 4 x the median of the last 15; for every frame missed once
/// more, up to three times), or where its cost exceeds the median m of the last 15 by more than 0.03 + 0.25 m. Then
/// wider searches around the prediction are tried, near to global, until one is believed; a jump that a search confirms
/// is believed. After three frames that no search has helped, searches run for every tenth such frame only.
/// A part whose frames before are ok and without a gap is found the quick way: one level (the second finest, else the
/// finest), one descent, robust weights once. Two frames are registered both ways first, and the quick way is gone only
/// where both end alike, within 0.2 mm or a quarter of a pixel at the rim. A quick result is believed as above, with
/// each view's cost for the cost; where it is not, the frame is registered in full. What it expects to be off is
/// multiplied by the median ratio to the full way's where both were gone. One tracker, one thread; several
/// may follow several objects at once, each with a backend of its own.
class Tracker {
public:
    /// `volume` and `backend` are borrowed for the tracker's life. Throws Error for bad options and volumes.
    Tracker(const Volume& volume, const RigidTransform& start_world_from_ct, const TrackOptions& options,
            Backend& backend);
    ~Tracker();
    Tracker(Tracker&&) noexcept;
    Tracker& operator=(Tracker&&) noexcept;

    /// A frame that was tracked before, by this tracker or one made alike: from here on this one goes on as that did,
    /// with the same bits. Throws Error for frame numbers that do not grow.
    void recall(const TrackFrame& frame);

    /// The next frame; every view needs an image. Throws Error for frame numbers that do not grow and bad views. Where
    /// the caller stops it, the frame's status is stopped and the tracker is as before: the same frame may be fed
    /// again.
    TrackFrame feed(int frame, std::span<const View> views, const RunControl& control = {});
    TrackFrame feed(int frame, const ViewsFor& views, const RunControl& control = {});

    /// The next frame has no images; `reason` says why.
    TrackFrame skip(int frame, const std::string& reason);

    /// World_from_ct where the next frame, of this number, would be sought first.
    [[nodiscard]] RigidTransform predicted(int frame) const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace raylign
