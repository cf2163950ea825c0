#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/backend.h"
#include "core/base/for_each.h"
#include "core/registration/object/cut_faces.h"
#include "core/registration/object/overlap.h"
#include "core/registration/object/pose_space.h"

namespace raylign::detail {

/// A volume kept on a backend for many registrations: checked once, halved once, and each halving made resident when it
/// is first needed. What a sequence of frames, and the levels of one registration, share. Borrows volume and backend
/// for its life; one thread, as its sessions.
class ResidentVolume {
public:
    /// Throws Error as check_volume and check_render do, and where no voxel attenuates.
    ResidentVolume(const Volume& volume, const RenderSettings& render, Backend& backend);

    [[nodiscard]] const Volume& volume() const { return volume_; }
    [[nodiscard]] const RenderSettings& render() const { return render_; }
    [[nodiscard]] Backend& backend() const { return backend_; }
    [[nodiscard]] const ObjectExtent& extent() const { return extent_; }
    [[nodiscard]] const ObjectSample& sample() const { return sample_; }
    [[nodiscard]] std::span<const CutFace> cut_faces() const { return cut_faces_; }

    /// The volume halved this often (core/image/pyramid.h); 0 = as given.
    [[nodiscard]] const Volume& halved(int halvings);
    /// A Session of these views: same bits as Backend::prepare with halved(halvings), and no step finer than allowed
    /// there.
    [[nodiscard]] std::unique_ptr<Session> session(int halvings, std::span<const View> views,
                                                   const Similarity& similarity);
    /// The same of the volume continued beyond its cut faces (object/continued.h).
    [[nodiscard]] std::unique_ptr<Session> continued_session(int halvings, std::span<const View> views,
                                                             const Similarity& similarity);
    /// Seconds that backends spent on making the volume resident since this was last asked; the sessions' own are in
    /// their timing.
    [[nodiscard]] double take_prepare_s();

private:
    [[nodiscard]] ForEach threads() const;
    [[nodiscard]] RenderSettings render_of(int halvings);
    [[nodiscard]] const Volume& continued(int halvings);
    [[nodiscard]] std::unique_ptr<Session> session_of(std::unique_ptr<Session>& resident, const Volume& volume,
                                                      int halvings, std::span<const View> views,
                                                      const Similarity& similarity);

    const Volume& volume_;
    RenderSettings render_;
    Backend& backend_;
    ObjectExtent extent_;
    ObjectSample sample_;
    std::vector<CutFace> cut_faces_;
    std::map<int, Volume> halved_, continued_;                               ///< by halvings; halved from 1
    std::map<int, std::unique_ptr<Session>> resident_, resident_continued_;  ///< their views have no images
    double prepare_s_ = 0;
};

}  // namespace raylign::detail
