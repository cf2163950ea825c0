#include "apps/track/viewer.h"

#include <algorithm>
#include <set>

#include "apps/shared/interrupt.h"
#include "apps/shared/repeated.h"

namespace raylign::detail::apps {
namespace {

// A page should stay light: a view of 256 x 256 pixels takes some 40 kB.
constexpr std::size_t kMostFrames = 48, kFewFrames = 8;
constexpr int kLongestSide_px = 256;

/// At most `count` of them, evenly, with both ends.
std::vector<std::size_t> thinned(const std::vector<std::size_t>& all, std::size_t count) {
    if (all.size() <= count) return all;
    std::vector<std::size_t> some;
    for (std::size_t k = 0; k < count; ++k) some.push_back(all[k * (all.size() - 1) / (count - 1)]);
    return some;
}

/// Positions of the frames to show: all, or those to look at and others between them.
std::vector<std::size_t> shown_frames(const TrackReport& report) {
    const std::size_t object_count = report.inputs.objects.size();
    std::vector<std::size_t> all, flagged;
    for (std::size_t i = 0; i < report.record.instants; ++i) {
        const auto rows = std::span(report.record.rows).subspan(i * object_count, object_count);
        const bool is_ok =
            std::ranges::all_of(rows, [](const TrajectoryRow& row) { return row.frame.status == TrackStatus::ok; });
        all.push_back(i);
        if (!is_ok) flagged.push_back(i);
    }
    if (all.size() <= kMostFrames) return all;
    std::vector<std::size_t> shown = thinned(all, kMostFrames / 2);
    const std::vector<std::size_t> more = thinned(flagged, kMostFrames / 2);
    shown.insert(shown.end(), more.begin(), more.end());
    std::ranges::sort(shown);
    shown.erase(std::unique(shown.begin(), shown.end()), shown.end());
    return shown;
}

ViewerFrame frame_of(const TrackReport& report, std::size_t at, InstantReader& reader, int longest_side_px) {
    const std::size_t object_count = report.inputs.objects.size();
    ViewerFrame frame;
    frame.number = report.inputs.frames[at].number;
    const Instant instant = reader.read(report.inputs.frames[at]);
    if (instant.gap.empty()) {
        frame.xrays = viewer_xrays(instant.views, XrayDepth::bits_8, longest_side_px);
    } else {
        frame.xrays.resize(report.inputs.views.views.size());
    }
    for (std::size_t o = 0; o < object_count; ++o) {
        const TrackFrame& found = report.record.rows[at * object_count + o].frame;
        frame.world_from_ct.push_back(found.world_from_ct);
        frame.status.emplace_back(status_name(found.status));
    }
    return frame;
}

}  // namespace

PageScript track_viewer(const TrackReport& report) {
    if (report.options.no_viewer || !has_viewer() || report.record.instants == 0) return {};
    const std::vector<std::size_t> shown = shown_frames(report);
    ViewerScene scene{.title = "",
                      .objects = {},
                      .views = report.inputs.views.views,
                      .origins = report.inputs.views.origins,
                      .frames = {},
                      .is_sequence = true,
                      .longest_side_px = shown.size() > kFewFrames ? kLongestSide_px : kLargestImageSide_px,
                      .go_on = report.options.go_on,
                      .folder = std::filesystem::current_path(),
                      .notes = {}};
    for (const TrackObject& object : report.inputs.objects) scene.objects.push_back({object.name, object.volume});
    InstantReader reader(report.inputs.views);
    for (const std::size_t at : shown) {
        if (interrupted()) return {};
        scene.frames.push_back(frame_of(report, at, reader, scene.longest_side_px));
    }
    return viewer_script_of(scene);
}

GoOn track_again(const CLI::App& command, const TrackCommandOptions& options) {
    const std::set<std::string> left_out{"--keyframe", "--output", "--json", "--quiet"};
    const auto keeps = [&](const CLI::Option& option) { return !left_out.contains(option.get_name()); };
    GoOn again{repeated("track", command, keeps), quote_for_shell({"-o", options.output.folder.string()})};
    for (const ObjectFlags& object : objects_of(options)) {
        for (const auto& [number, file] : object.key_frames) {
            const std::string value = object.name + ":" + std::to_string(number) + "=" + file;
            again.key_frames.push_back({object.name, number, quote_for_shell({"--keyframe", value})});
        }
    }
    return again;
}

}  // namespace raylign::detail::apps
