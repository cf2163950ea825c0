#include "apps/track/pictures.h"

#include <algorithm>
#include <iterator>

#include "apps/shared/interrupt.h"

namespace raylign::detail::apps {
namespace {

constexpr std::size_t kMostObjects = 3, kMostDoubtful = 4;  // a page should stay light

/// Positions of the frames to show among those of one object.
std::vector<std::size_t> frames_to_show(const std::vector<const TrackFrame*>& frames) {
    std::vector<std::size_t> with_pose;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        if (pose_of(*frames[i])) with_pose.push_back(i);
    }
    if (with_pose.empty()) return {};
    const auto costs_less = [&](std::size_t a, std::size_t b) { return frames[a]->cost < frames[b]->cost; };
    std::vector<std::size_t> shown{with_pose.front(), with_pose[with_pose.size() / 2], with_pose.back(),
                                   *std::ranges::max_element(with_pose, costs_less)};
    std::vector<std::size_t> doubtful;
    const auto is_doubted = [&](std::size_t i) { return frames[i]->status != TrackStatus::ok; };
    std::ranges::copy_if(with_pose, std::back_inserter(doubtful), is_doubted);
    for (std::size_t k = 0; k < std::min(kMostDoubtful, doubtful.size()); ++k) {
        shown.push_back(doubtful[k * doubtful.size() / std::min(kMostDoubtful, doubtful.size())]);
    }
    std::ranges::sort(shown);
    shown.erase(std::unique(shown.begin(), shown.end()), shown.end());
    return shown;
}

}  // namespace

std::vector<PageOverlay> track_pictures(const TrackReport& report, Backend& backend,
                                        const std::filesystem::path& scratch) {
    std::vector<PageOverlay> overlays;
    InstantReader reader(report.inputs.views);
    const TrackOptions options = track_options(report.options, report.inputs.frame_step);
    const RegistrationOptions& registration = options.registration;
    for (std::size_t o = 0; o < std::min(report.inputs.objects.size(), kMostObjects); ++o) {
        const TrackObject& object = report.inputs.objects[o];
        const std::vector<const TrackFrame*> frames = frames_of(report.record.rows, object.name);
        const auto session = backend.prepare({object.volume, report.inputs.views.views, registration.render, {}});
        for (const std::size_t i : frames_to_show(frames)) {
            if (interrupted()) return overlays;
            const Instant instant = reader.read(report.inputs.frames[i]);
            for (std::size_t v = 0; instant.gap.empty() && v < instant.views.size(); ++v) {
                const std::string title = object.name + ", frame " + std::to_string(frames[i]->frame) + " (" +
                                          std::string(status_name(frames[i]->status)) + "), " + instant.views[v].name;
                overlays.push_back(page_overlay(title, instant.views[v],
                                                session->render(frames[i]->predicted_world_from_ct, v),
                                                session->render(frames[i]->world_from_ct, v), scratch));
            }
        }
    }
    return overlays;
}

}  // namespace raylign::detail::apps
