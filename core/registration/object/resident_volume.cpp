#include "core/registration/object/resident_volume.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/image/pyramid.h"
#include "core/registration/object/continued.h"

namespace raylign::detail {
namespace {

constexpr double kContinued_mm = 60;  // how far starts may be off

}  // namespace

ResidentVolume::ResidentVolume(const Volume& volume, const RenderSettings& render, Backend& backend)
    : volume_(volume), render_(render), backend_(backend) {
    check_shape(volume, "the volume");
    check_render(render, volume.grid);
    const VolumeSums sums = volume_sums(volume, threads());
    if (!std::isfinite(sums.mass)) check_volume(volume, "the volume");  // says which voxel it is
    extent_ = object_extent(sums, volume.grid);
    sample_ = sample_object(sums, volume.grid);
    cut_faces_ = detail::cut_faces(volume, sums);
}

const Volume& ResidentVolume::halved(int halvings) {
    if (halvings == 0) return volume_;
    const auto found = halved_.find(halvings);
    if (found != halved_.end()) return found->second;
    return halved_.emplace(halvings, half_resolution(halved(halvings - 1), threads())).first->second;
}

const Volume& ResidentVolume::continued(int halvings) {
    const auto found = continued_.find(halvings);
    if (found != continued_.end()) return found->second;
    return continued_.emplace(halvings, detail::continued(halved(halvings), cut_faces_, kContinued_mm)).first->second;
}

std::unique_ptr<Session> ResidentVolume::session(int halvings, std::span<const View> views,
                                                 const Similarity& similarity) {
    return session_of(resident_[halvings], halved(halvings), halvings, views, similarity);
}

std::unique_ptr<Session> ResidentVolume::continued_session(int halvings, std::span<const View> views,
                                                           const Similarity& similarity) {
    return session_of(resident_continued_[halvings], continued(halvings), halvings, views, similarity);
}

std::unique_ptr<Session> ResidentVolume::session_of(std::unique_ptr<Session>& resident, const Volume& volume,
                                                    int halvings, std::span<const View> views,
                                                    const Similarity& similarity) {
    if (!resident) {
        std::vector<View> without_images(views.begin(), views.end());
        for (View& view : without_images) view.image = view.weights = {};  // it only holds the volume
        resident = backend_.prepare({volume, without_images, render_of(halvings), similarity, true});
        prepare_s_ += resident->timing().prepare_s;
    }
    return resident->with_views(views, similarity);
}

ForEach ResidentVolume::threads() const {
    return [this](std::size_t count, const std::function<void(std::size_t)>& turn) {
        backend_.for_each_index(count, turn);
    };
}

/// Halved voxels are larger: a step that suits the volume may be finer than check_render lets one be there.
RenderSettings ResidentVolume::render_of(int halvings) {
    RenderSettings settings = render_;
    if (settings.step_mm) settings.step_mm = std::max(*settings.step_mm, finest_step_mm(halved(halvings).grid));
    return settings;
}

double ResidentVolume::take_prepare_s() { return std::exchange(prepare_s_, 0); }

}  // namespace raylign::detail
