#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/registration/level/plan.h"
#include "core/registration/object/resident_volume.h"
#include "core/registration/scene/remainder.h"
#include "raylign/tracking.h"

namespace raylign::detail {

/// What is known of where an object is in a frame before the frame is looked at.
enum class Whereabouts {
    unknown,  ///< it was lost: it hides nothing that could be told
    start,    ///< where somebody says that it begins
    rough,    ///< where the frames before point to, as far as they are believed
    near,     ///< the same, where they were sure and tell a velocity
    settled,  ///< found already: it does not move any more
};
struct Expectation {
    Whereabouts known = Whereabouts::unknown;
    RigidTransform world_from_ct;  ///< of all but unknown ones
};

/// What frames so far say about where an object will be in the next one.
class Prospect {
public:
    void remember(const TrackFrame& found);
    [[nodiscard]] Whereabouts whereabouts() const;

private:
    std::optional<TrackStatus> last_;  ///< none = not tracked yet
    int sure_ = 0;                     ///< frames in a row that were ok
};

/// Objects that one sequence of X-rays shows, so that each can be tracked against what the others leave. In a frame all
/// whose place is about known, and whose shadows may meet another's in a view, are put together first, from where they
/// are expected: by register_scene where one of them begins, on one level where all are near (follow_together), else
/// coarse to fine. A function of the frame and of what is expected.
class Company {
public:
    /// Borrows volumes and backend for its life. Throws Error as register_scene does.
    Company(std::span<const Volume* const> volumes, const TrackOptions& options, Backend& backend);

    /// Whether these options allow it: gauss-newton, on a backend with derivatives.
    [[nodiscard]] static bool is_possible(const TrackOptions& options, const Backend& backend);

    /// Puts the objects of a frame together. `expected`: one per object.
    void meet(std::span<const View> views, std::span<const Expectation> expected, const RunControl& control);

    /// The frame's X-rays less what the others show; as they are where no other was put anywhere. `coarser_by`: as for
    /// ViewsFor; the others are drawn no finer than the object is looked at.
    [[nodiscard]] std::vector<View> remainder(std::span<const View> views, std::size_t object,
                                              std::optional<int> coarser_by = std::nullopt);

private:
    [[nodiscard]] std::vector<std::size_t> who_meet(std::span<const View> views,
                                                    std::span<const Expectation> expected) const;
    void put_together(std::span<const View> views, std::span<const Expectation> expected, const RunControl& control);
    [[nodiscard]] std::vector<RigidTransform> begun(std::span<const View> views, std::span<const Expectation> expected,
                                                    const RunControl& control);

    [[nodiscard]] std::vector<LevelPlan> levels(std::span<const View> views, std::size_t object) const;
    [[nodiscard]] const std::vector<Image>& drawing(std::span<const View> views, std::size_t member,
                                                    const Fineness& fineness);

    TrackOptions options_;
    std::deque<ResidentVolume> volumes_;
    std::vector<RigidTransform> expected_;                                     ///< per object, in the last frame
    std::vector<std::size_t> members_;                                         ///< of that frame
    std::vector<RigidTransform> world_from_ct_;                                ///< per member: where it was put
    std::vector<double> gains_;                                                ///< per view, as Shown has them
    std::map<std::pair<std::size_t, Fineness>, std::vector<Image>> drawings_;  ///< of members, once they were asked for
};

}  // namespace raylign::detail
