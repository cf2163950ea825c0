#include "apps/track/chain.h"

#include "apps/shared/interrupt.h"
#include "core/base/number_text.h"

namespace raylign::detail::apps {
namespace {

constexpr double kSamePose_mm = 0.1;  // below the jitter of good tracks

/// "120- " and the pose: rows of a corrected key frame do not count for another correction.
std::string chain_name(const Chain::Key& key, Direction direction) {
    std::string name = std::to_string(key.frame) + (direction == Direction::forwards ? "+" : "-");
    for (const double value : key.world_from_ct.rotation.reshaped()) name += " " + number_text(value);
    for (const double value : key.world_from_ct.translation_mm) name += " " + number_text(value);
    return name;
}

}  // namespace

Chain::Chain(const TrackObject& object, const Key& key, Direction direction, const TrackOptions& options,
             Backend& backend, FrameJournal& journal)
    : object_(object),
      key_(key),
      sign_(direction == Direction::forwards ? 1 : -1),
      name_(chain_name(key, direction)),
      tracker_(object.volume, key.world_from_ct, options, backend),
      journal_(journal),
      extent_(object_extent(object.volume)) {}

/// The tracker's time runs the way the chain goes.
TrackFrame Chain::in_time(TrackFrame frame) const {
    frame.frame *= sign_;
    return frame;
}

void Chain::begin_with(const TrackFrame& frame) {
    tracker_.recall(in_time(frame));
    prospect_.remember(frame);
    last_ = frame.frame;
}

const JournalRow* Chain::known_row(int frame, const std::vector<std::string>& sha256) const {
    const JournalRow* row = is_new_ ? nullptr : journal_.find(object_.name, frame, name_, last_);
    if (row == nullptr && agreed_) row = journal_.other(object_.name, frame, name_);
    return row != nullptr && row->sha256 == sha256 ? row : nullptr;
}

bool Chain::comes_back(const TrackFrame& found) const {
    if (!key_.is_correction || found.status != TrackStatus::ok) return false;
    const JournalRow* before = journal_.other(object_.name, found.frame, name_);
    if (before == nullptr || before->frame.status != TrackStatus::ok) return false;
    return apart_mm(found.world_from_ct, before->frame.world_from_ct, extent_) < kSamePose_mm;
}

Expectation Chain::expectation(int frame) const { return {prospect_.whereabouts(), tracker_.predicted(sign_ * frame)}; }

TrackFrame Chain::next(int frame, const std::vector<std::string>& sha256, const std::function<Sight()>& look,
                       const RunControl& control) {
    const JournalRow* known = known_row(frame, sha256);
    was_recalled_ = known != nullptr;
    TrackFrame found;
    if (known != nullptr) {
        found = known->frame;
        agreed_ = agreed_ || known->agrees;
        tracker_.recall(in_time(found));
    } else {
        const Sight sight = look();
        found = in_time(sight.gap.empty() ? tracker_.feed(sign_ * frame, sight.views, control)
                                          : tracker_.skip(sign_ * frame, sight.gap));
        if (control.stop.stop_requested()) throw Interrupted("interrupted: no file was changed");
        is_new_ = true;
        agreed_ = comes_back(found);
        journal_.append({object_.name, name_, last_, agreed_, sha256, found});
    }
    prospect_.remember(found);
    last_ = frame;
    return found;
}

}  // namespace raylign::detail::apps
