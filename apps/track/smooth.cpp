#include "apps/track/smooth.h"

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/number_text.h"
#include "core/io/files/text.h"
#include "core/registration/object/pose_space.h"

namespace raylign::detail::apps {
namespace {

std::vector<TrackSample> samples_of(const std::vector<TrajectoryRow>& rows, const std::string& object) {
    std::vector<double> errors;
    for (const TrajectoryRow& row : rows) {
        const TrackFrame& frame = row.frame;
        if (row.object == object && pose_of(frame) && frame.expected_error_mm > 0) {
            errors.push_back(frame.expected_error_mm);
        }
    }
    const double usual = errors.empty() ? 1 : median(errors);
    std::vector<TrackSample> samples;
    for (const TrajectoryRow& row : rows) {
        if (row.object != object) continue;
        const double error_mm = row.frame.expected_error_mm;
        samples.push_back({pose_of(row.frame), error_mm > 0 ? error_mm : usual});
    }
    return samples;
}

}  // namespace

SmoothWish parse_smooth(const std::string& text) {
    if (text == "none") return {};
    if (text == "auto") return {true, std::nullopt};
    const std::optional<double> strength = number_from(text);
    if (strength && *strength > 0 && *strength <= 1e9) return {true, strength};
    throw bad_value("--smooth", text, "none, auto or a strength in (0, 1e9]");
}

std::vector<TrackJitter> jitters_of(const std::vector<TrajectoryRow>& rows, const TrackInputs& inputs) {
    std::vector<TrackJitter> jitters;
    for (const TrackObject& object : inputs.objects) {
        jitters.push_back(jitter_of(samples_of(rows, object.name), object_extent(object.volume).centre_ct_mm));
    }
    return jitters;
}

std::vector<TrajectoryRow> smoothed_rows(std::vector<TrajectoryRow> rows, const TrackInputs& inputs,
                                         const SmoothWish& wish, std::vector<std::string>& notes) {
    for (const TrackObject& object : inputs.objects) {
        const SmoothTrack smooth =
            smoothed(samples_of(rows, object.name), object_extent(object.volume).centre_ct_mm, wish.strength);
        std::size_t at = 0;
        for (TrajectoryRow& row : rows) {
            if (row.object != object.name) continue;
            if (smooth.world_from_ct[at]) row.frame.world_from_ct = *smooth.world_from_ct[at];
            ++at;
        }
        notes.push_back(object.name + ": smoothed with strengths " + number_text(smooth.translation_strength) +
                        " (places) and " + number_text(smooth.rotation_strength) + " (rotations)");
    }
    return rows;
}

}  // namespace raylign::detail::apps
