#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/image/view_crop.h"
#include "core/registration/object/resident_volume.h"

namespace raylign::detail {

/// What one object adds to one view: the filtered channels of its DRR, and of the DRR's derivatives, on a box of
/// pixels. Zero beyond: the filter is linear and reaches no farther.
struct Footprint {
    PixelBox box;
    Image drr;
    std::vector<Image> channels;
    /// Per channel, a column a pixel of the box: by the six parameters of PoseSpace [per mm at the rim].
    std::vector<Eigen::Matrix<float, 6, Eigen::Dynamic>> jacobian;
};

/// One object of a scene on one level: its footprints at a pose. They depend on this pose alone and are kept while the
/// object stays; derivatives are kept while it has hardly moved.
class ObjectImages {
public:
    /// `views`: of the level; their images are not used. Borrows the volume.
    ObjectImages(ResidentVolume& volume, int halvings, std::vector<View> views, const Similarity& similarity,
                 double pixel_at_object_mm);

    /// Makes the footprints those at this pose.
    void show(const RigidTransform& world_from_ct);
    /// Makes their derivatives those at the pose shown, or at one nearer to it than a tenth of a pixel.
    void differentiate();
    [[nodiscard]] const Footprint& footprint(std::size_t view) const { return footprints_[view]; }
    [[nodiscard]] const RigidTransform& pose() const { return *shown_; }
    [[nodiscard]] const ObjectExtent& extent() const { return volume_.extent(); }
    [[nodiscard]] const Session& session() const { return *session_; }

private:
    void frame(const RigidTransform& world_from_ct);

    ResidentVolume& volume_;
    int halvings_;
    std::vector<View> views_;
    Similarity similarity_;
    double pixel_mm_;
    std::unique_ptr<Session> session_;  ///< of the windows
    std::vector<Footprint> footprints_;
    std::optional<RigidTransform> shown_, differentiated_;
};

}  // namespace raylign::detail
