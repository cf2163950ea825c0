#include "core/registration/strategy/domain.h"

#include <algorithm>
#include <cmath>

#include "core/image/gradient_filter.h"
#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

/// None where no side cuts tissue or too little would remain.
std::vector<Image> without_cut_off(Run& run, Level& level, const RigidTransform& world_from_ct) {
    const std::span<const CutFace> faces = run.resident.cut_faces();
    if (faces.empty()) return {};
    // A continued CT has no edge at the cut; else the edge lies within a pixel, and the filter reaches there.
    const GradientFilter& filter = level.plan().filter;
    const int margin_px =
        level.is_continued() ? std::max(1, static_cast<int>(std::lround(filter.sigma_px / 2))) : filter.radius_px + 1;
    std::vector<Image> within;
    for (const View& view : level.views()) {
        const Image pixels = within_cut_faces(faces, run.volume().grid, view.geometry, world_from_ct);
        within.push_back(erode_weights(pixels, margin_px));
    }
    if (!leaves_enough(level.session(), within)) return {};
    return within;
}

/// Of a whole: none as well where the X-ray ends where the CT does, or where that is not known.
std::vector<Image> without_more_than_the_ct(Run& run, Level& level, const RigidTransform& world_from_ct) {
    if (run.shows_the_cut.value_or(true)) return {};
    return without_cut_off(run, level, world_from_ct);
}

std::vector<Image> evened_out(Level& level) {
    return local_normalisation(level.session(), kNormalisation_mm / level.plan().pixel_at_object_mm);
}

}  // namespace

std::optional<CutCosts> costs_about_the_cut(Run& run, Level& level, const RigidTransform& world_from_ct) {
    const std::vector<Image> within = without_cut_off(run, level, world_from_ct);
    if (within.empty()) return std::nullopt;
    std::vector<Image> beyond = within;
    for (Image& image : beyond) {
        for (float& pixel : image.pixels) pixel = 1 - pixel;
    }
    if (!leaves_enough(level.session(), beyond)) return std::nullopt;
    const auto session = run.resident.session(level.plan().volume_halvings, level.views(),
                                              {run.options.similarity.metric, level.plan().filter});
    const auto cost_on = [&](const std::vector<Image>& weights) {
        double cost = 0;
        session->set_weights(weights);
        session->evaluate({&world_from_ct, 1}, {&cost, 1});
        return cost;
    };
    const CutCosts costs{cost_on(within), cost_on(beyond)};
    level.count(*session);
    return costs;
}

void weigh_whole(Run& run, Level& level, const RigidTransform& world_from_ct) {
    const std::vector<Image> within = without_more_than_the_ct(run, level, world_from_ct);
    if (!within.empty()) level.session().set_weights(within);
}

void weigh_whole_evenly(Run& run, Level& level, const RigidTransform& world_from_ct) {
    std::vector<Image> weights = without_more_than_the_ct(run, level, world_from_ct);
    if (!weights.empty()) level.session().set_weights(weights);
    const std::vector<Image> even = evened_out(level);
    if (weights.empty()) {
        weights = even;
    } else {
        multiply(weights, even);
    }
    level.session().set_weights(weights);
}

void weigh_part(Run& run, Level& level, const RigidTransform& world_from_ct) {
    const int margin_px =
        static_cast<int>(std::ceil(kDomainMargin_mm / level.plan().pixel_at_object_mm)) + level.plan().filter.radius_px;
    std::vector<Image> weights = neighbourhood(level.session(), world_from_ct, margin_px);
    multiply(weights, evened_out(level));
    std::vector<Image> within = without_cut_off(run, level, world_from_ct);
    if (!within.empty()) {
        multiply(within, weights);
        if (leaves_enough(level.session(), within)) weights = std::move(within);
    }
    level.session().set_weights(weights);
}

}  // namespace raylign::detail
