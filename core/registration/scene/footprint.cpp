#include "core/registration/scene/footprint.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/similarity/similarity.h"

namespace raylign::detail {
namespace {

constexpr double kKept_px = 0.1;  // derivatives change over the width of the filter, which is wider by ten
constexpr int kSlack_px = 6;      // how far an object may move before its window is cut anew

bool holds(const PixelBox& outer, const PixelBox& inner) {
    return (inner.begin - outer.begin).minCoeff() >= 0 && (outer.end - inner.end).minCoeff() >= 0;
}

int margin_px(const Similarity& similarity) {
    return similarity.metric == Metric::gc ? similarity.filter.radius_px + 1 : 1;
}

}  // namespace

ObjectImages::ObjectImages(ResidentVolume& volume, int halvings, std::vector<View> views, const Similarity& similarity,
                           double pixel_at_object_mm)
    : volume_(volume),
      halvings_(halvings),
      views_(std::move(views)),
      similarity_(similarity),
      pixel_mm_(pixel_at_object_mm),
      footprints_(views_.size()) {
    for (View& view : views_) view.image = view.weights = {};
}

/// Cuts the windows anew where the object leaves one.
void ObjectImages::frame(const RigidTransform& world_from_ct) {
    const VoxelGrid& grid = volume_.halved(halvings_).grid;
    const int margin = margin_px(similarity_);
    bool is_held = session_ != nullptr;
    for (std::size_t v = 0; v < views_.size() && is_held; ++v) {
        is_held = holds(footprints_[v].box, reached_pixels(views_[v].geometry, grid, world_from_ct, margin));
    }
    if (is_held) return;
    std::vector<View> windows;
    for (std::size_t v = 0; v < views_.size(); ++v) {
        footprints_[v].box = reached_pixels(views_[v].geometry, grid, world_from_ct, margin + kSlack_px);
        windows.push_back(crop(views_[v], footprints_[v].box));
    }
    session_ = volume_.session(halvings_, windows, similarity_);
    differentiated_.reset();
}

void ObjectImages::show(const RigidTransform& world_from_ct) {
    const bool is_shown =
        shown_ && shown_->rotation == world_from_ct.rotation && shown_->translation_mm == world_from_ct.translation_mm;
    if (is_shown) return;
    frame(world_from_ct);
    for (std::size_t v = 0; v < views_.size(); ++v) footprints_[v].drr = session_->render(world_from_ct, v);
    session_->for_each_index(views_.size(), [this](std::size_t v) {
        footprints_[v].channels = moving_channels(footprints_[v].drr, similarity_);
    });
    shown_ = world_from_ct;
}

void ObjectImages::differentiate() {
    if (differentiated_ && apart_mm(*differentiated_, *shown_, extent()) < kKept_px * pixel_mm_) return;
    std::vector<Image> derivatives;
    for (std::size_t v = 0; v < views_.size(); ++v) {
        DrrWithDerivatives at = session_->render_with_derivatives(*shown_, extent().centre_ct_mm, v);
        for (Image& image : at.derivatives) derivatives.push_back(std::move(image));
    }
    for (std::size_t v = 0; v < views_.size(); ++v) {
        footprints_[v].jacobian.resize(session_->channel_count());
        for (auto& columns : footprints_[v].jacobian) {
            columns.resize(Eigen::NoChange, static_cast<Eigen::Index>(footprints_[v].drr.pixels.size()));
        }
    }
    session_->for_each_index(derivatives.size(), [&](std::size_t i) {
        const std::vector<Image> channels = moving_channels(derivatives[i], similarity_);
        // A turn is told by what it moves the rim.
        const auto per_parameter = static_cast<float>(i % 6 < 3 ? 1 / extent().radius_mm : 1);
        Footprint& footprint = footprints_[i / 6];
        for (std::size_t c = 0; c < channels.size(); ++c) {
            const auto count = static_cast<Eigen::Index>(channels[c].pixels.size());
            footprint.jacobian[c].row(static_cast<Eigen::Index>(i % 6)) =
                per_parameter * Eigen::Map<const Eigen::RowVectorXf>(channels[c].pixels.data(), count);
        }
    });
    differentiated_ = shown_;
}

}  // namespace raylign::detail
