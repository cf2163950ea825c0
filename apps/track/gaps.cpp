#include "apps/track/gaps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/base/median.h"
#include "core/base/number_text.h"
#include "core/registration/object/pose_space.h"
#include "core/tracking/depth_gap.h"

namespace raylign::detail::apps {
namespace {

std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const TrackInputs& inputs) {
    if (!inputs.joints.empty()) return inputs.joints;
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t k = 1; k < inputs.objects.size(); ++k) pairs.emplace_back(k - 1, k);
    return pairs;
}

}  // namespace

std::vector<TrajectoryRow> rows_with_gaps_held(std::vector<TrajectoryRow> rows, const TrackInputs& inputs,
                                               double gap_mm, std::vector<std::string>& notes) {
    const ViewGeometry& view = inputs.views.views.front().geometry;
    std::vector<Eigen::Vector3d> centres_ct_mm;
    for (const TrackObject& object : inputs.objects) {
        centres_ct_mm.push_back(object_extent(object.volume).centre_ct_mm);
    }
    struct Place {
        std::size_t frame, object;
    };
    std::map<int, std::size_t> places;  // of frames by number
    std::vector<DepthsOfFrame> depths;
    std::vector<Place> of_row;
    for (const TrajectoryRow& row : rows) {
        const auto [at, is_new] = places.emplace(row.frame.frame, depths.size());
        if (is_new) depths.emplace_back(inputs.objects.size());
        const auto object = static_cast<std::size_t>(std::ranges::find(inputs.objects, row.object, &TrackObject::name) -
                                                     inputs.objects.begin());
        of_row.push_back({at->second, object});
        depths[at->second][object] = depth_of(row.frame, centres_ct_mm[object], view);
    }
    const std::vector<DepthsOfFrame> held = hold_gaps(depths, pairs_of(inputs), gap_mm);
    std::vector<double> moved_mm;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto& before = depths[of_row[i].frame][of_row[i].object];
        const auto& after = held[of_row[i].frame][of_row[i].object];
        if (!before || !after || before->depth_mm == after->depth_mm) continue;
        move_to(rows[i].frame, *after, centres_ct_mm[of_row[i].object], view);
        moved_mm.push_back(std::abs(after->depth_mm - before->depth_mm));
    }
    notes.push_back("--joint-gap " + number_text(gap_mm) + " mm: depths of " + std::to_string(moved_mm.size()) +
                    " of " + std::to_string(rows.size()) + " rows were moved" +
                    (moved_mm.empty() ? "" : ", by " + fixed(median(moved_mm), 2) + " mm (median)") +
                    "; track.journal has them as each image alone says");
    return rows;
}

}  // namespace raylign::detail::apps
