#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/grid.h"
#include "raylign/image.h"
#include "raylign/rigid_transform.h"
#include "raylign/similarity.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign {

namespace detail {  // what backends exchange with the library; only those who write one need to know
struct RayFrame;
struct RayFrameDerivative;
using RayFrameDerivatives = std::array<RayFrameDerivative, 6>;
struct MomentSums;
struct JacobianSums;
struct FixedChannels;
class SurfaceDrr;
struct DescentProblem;
struct DescentStart;
struct DescentView;
struct DescentEnd;
}  // namespace detail

/// How a ray samples the volume.
enum class Projector {
    joseph,     ///< planes of the dominant index axis, bilinear in-plane [Joseph82]; default
    trilinear,  ///< midpoint rule with a fixed step
};
/// "joseph", "trilinear"; the other way throws Error for another name.
[[nodiscard]] std::string_view projector_name(Projector projector);
[[nodiscard]] Projector projector_from_name(std::string_view name);

/// How DRRs are made.
struct RenderSettings {
    Projector projector = Projector::joseph;
    std::optional<double> step_mm;  ///< trilinear only; default: half the smallest voxel side; in (0, 100]
};

/// What a Session is made from. Volume and views are borrowed for the call of prepare() only.
struct Scene {
    const Volume& volume;
    std::span<const View> views;
    RenderSettings render;
    Similarity similarity;
    bool voxels_are_finite = false;  ///< as the caller knows: spares a look at each of them
};

/// The DRR of one view, and what it changes by with each pose parameter: a rotation [rad] about x, y, z, then a shift
/// [mm] along them, all of the world. Line integrals, and those per rad and per mm.
struct DrrWithDerivatives {
    Image drr;
    std::array<Image, 6> derivatives;
};

/// Seconds spent in each stage since the Session was made: the rows of the paper's Table 2. With several threads the
/// stages share the wall time in proportion to the time that the threads spent in them.
struct SessionTiming {
    double prepare_s = 0, drr_s = 0, gradient_s = 0, reduction_s = 0, transfer_s = 0;
};

/// Work done since the Session was made.
struct SessionCounters {
    std::uint64_t evaluations = 0;     ///< poses evaluated (all views of a pose count once)
    std::uint64_t linearizations = 0;  ///< poses linearized
    std::uint64_t bytes_to_host = 0;   ///< read back from a device; 0 for backends in host memory
};

/// A Scene made resident on one device. One Session, one thread; several Sessions may live at once.
class Session {
public:
    virtual ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    /// Cost per pose: the mean over views of view_cost, weighted by View::cost_weight, in [0, 2]. Sizes of both spans
    /// must agree. Throws Error for a non-finite pose; a NaN cost is returned as such and is the caller's to stop on.
    void evaluate(std::span<const RigidTransform> world_from_ct, std::span<double> costs);

    /// Cost, gradient and Gauss-Newton matrix per pose, with respect to a twist (rad, mm) about the point
    /// `centre_ct_mm` of the volume (its place in world under that pose). Costs as in evaluate. Throws as evaluate
    /// does.
    void linearize(std::span<const RigidTransform> world_from_ct, const Eigen::Vector3d& centre_ct_mm,
                   std::span<Linearization> results);

    /// The same for each view alone, [pose][view], views innermost: what linearize gives is their sum, weighted by
    /// view_share. Costs the same. Throws as linearize does.
    void linearize_views(std::span<const RigidTransform> world_from_ct, const Eigen::Vector3d& centre_ct_mm,
                         std::span<Linearization> results);
    /// Share of a view in the cost, from View::cost_weight; all shares sum to one.
    [[nodiscard]] double view_share(std::size_t view) const { return view_shares_.at(view); }

    /// Levenberg-Marquardt searches from all starts, which the backend runs by itself; nothing where it leaves their
    /// steps to its caller. Costs are those of linearize. Throws as linearize_views does, and what `problem` throws.
    [[nodiscard]] std::optional<std::vector<detail::DescentEnd>> descend(const detail::DescentProblem& problem,
                                                                         std::span<const detail::DescentStart> starts);

    /// The sums behind the costs, [pose][view][channel], channels innermost: for comparing backends.
    [[nodiscard]] std::vector<detail::MomentSums> moment_sums(std::span<const RigidTransform> world_from_ct);

    /// Replaces the weights of all views until the next call: one image per view, finite and not negative; pixels that
    /// the views' masks exclude stay excluded. For robust weights (iteratively reweighted least squares), which must be
    /// the same for all poses compared. Throws Error for other sizes or values, or if fewer than 32 pixels
    /// remain.
    void set_weights(std::span<const Image> weights);
    /// How often they were replaced: costs of one pose can differ where this does.
    [[nodiscard]] std::uint64_t weight_changes() const { return weight_changes_; }

    /// The channels of one view that costs are made of: of the X-ray, with the weights in use, and of the DRR at a pose
    /// (the same filter, in core). Throws Error where the view has no image.
    [[nodiscard]] const detail::FixedChannels& fixed_channels(std::size_t view) const;
    [[nodiscard]] std::vector<Image> moving_channels(const RigidTransform& world_from_ct, std::size_t view);

    /// The DRR of one view: line integrals, one per pixel of its camera. Throws Error for a non-finite pose.
    [[nodiscard]] Image render(const RigidTransform& world_from_ct, std::size_t view);

    /// The same with its derivatives with respect to a twist about the point `centre_ct_mm`, as in linearize. Counts as
    /// no linearization. Throws Error as render does, for a centre that is not finite, and where the backend has no
    /// derivatives.
    [[nodiscard]] DrrWithDerivatives render_with_derivatives(const RigidTransform& world_from_ct,
                                                             const Eigen::Vector3d& centre_ct_mm, std::size_t view);
    /// Any image of a view's size as the metric sees it: one image per channel, not weighted. Linear in the image.
    [[nodiscard]] std::vector<Image> channels_of(const Image& image) const;

    /// A Session of other views on the same resident volume, with the render settings of this one: the volume is not
    /// read, copied or uploaded again. Same bits as a fresh Backend::prepare. Sessions that share a volume may end in
    /// any order but belong to one thread. Throws Error as prepare does for views that it refuses.
    [[nodiscard]] virtual std::unique_ptr<Session> with_views(std::span<const View> views,
                                                              const Similarity& similarity) = 0;

    /// Calls turn(i) for every i in [0, count), on the threads that the backend works with on the host; in order where
    /// it has none. For work beside the rendering: no second pool of threads competes. Turns must not depend on each
    /// other.
    virtual void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn);

    [[nodiscard]] std::size_t view_count() const { return views_.size(); }
    [[nodiscard]] int channel_count() const { return channel_count_; }
    [[nodiscard]] const SessionTiming& timing() const { return timing_; }
    [[nodiscard]] const SessionCounters& counters() const { return counters_; }
    /// Bytes that the backend's own copy of the volume takes.
    [[nodiscard]] virtual std::size_t volume_bytes() const = 0;
    /// How it keeps them, for people: the storage, and what else there is to say.
    [[nodiscard]] virtual std::string volume_layout() const { return "float32"; }

protected:
    /// Checks the scene as Backend::prepare says and keeps its geometry.
    explicit Session(const Scene& scene);
    /// Other views of the volume that `resident` holds: checks these only.
    Session(const Session& resident, std::span<const View> views, const Similarity& similarity);

    /// Sums for every frame: sums[frame * channel_count() + channel]. Frames are pose-major.
    virtual void accumulate(std::span<const detail::RayFrame> frames, std::span<detail::MomentSums> sums) = 0;
    /// The same with derivatives, one set per frame.
    virtual void accumulate(std::span<const detail::RayFrame> frames,
                            std::span<const detail::RayFrameDerivatives> derivatives,
                            std::span<detail::JacobianSums> sums) = 0;
    virtual Image render_frame(const detail::RayFrame& frame) = 0;
    virtual DrrWithDerivatives render_frame(const detail::RayFrame& frame,
                                            const detail::RayFrameDerivatives& derivatives) = 0;
    /// True if the backend has descents of its own.
    [[nodiscard]] virtual bool descends() const { return false; }
    /// See descend: one view for each of the session's, and frames of all starts, pose-major.
    virtual std::vector<detail::DescentEnd> run_descents(const detail::DescentProblem& problem,
                                                         std::span<const detail::DescentView> views,
                                                         std::span<const detail::DescentStart> starts,
                                                         std::span<const detail::RayFrame> start_frames);
    /// The weights in fixed() have changed: backends that keep copies renew them.
    virtual void weights_changed() = 0;

    /// What DRRs are made from instead of voxels, where the volume has a surface; else null.
    [[nodiscard]] const std::shared_ptr<const detail::SurfaceDrr>& surface() const { return surface_; }

    /// Fixed channels per view, made once in core so that backends cannot disagree on them; empty where views lack
    /// images.
    [[nodiscard]] const std::vector<detail::FixedChannels>& fixed() const { return fixed_; }

    SessionTiming timing_;
    SessionCounters counters_;

private:
    void take_views(std::span<const View> views);
    void check_view_index(std::size_t view) const;
    [[nodiscard]] std::vector<detail::RayFrame> frames_for(std::span<const RigidTransform> world_from_ct) const;

    VoxelGrid grid_;
    std::shared_ptr<const detail::SurfaceDrr> surface_;
    Similarity similarity_;
    std::vector<ViewGeometry> views_;
    std::vector<double> view_shares_;  ///< of the cost; they sum to one
    std::vector<double> ceilings_;     ///< View::ceiling
    std::vector<detail::FixedChannels> fixed_;
    std::vector<Image> mask_weights_;  ///< what fixed_ began with: set_weights cannot bring masked pixels back
    std::uint64_t weight_changes_ = 0;
    int channel_count_;
};

/// What runs, for reports.
struct BackendInfo {
    std::string name;     ///< as given to --backend
    std::string summary;  ///< one line for people
    std::string device;   ///< processor or GPU
    int threads = 1;
    std::string instruction_set;          ///< of a CPU backend; empty otherwise
    std::string storage = "float32";      ///< how voxels are kept: float32 or int16
    std::string interpolation = "exact";  ///< exact, or hardware: texture filters, with 8-bit fractions on GPUs
    std::string timing = "wall clock";    ///< what SessionTiming comes from: wall clock, or timer queries of a GPU
    std::string solver = "host";          ///< who solves for steps of gauss-newton: host or device
    bool has_derivatives = true;          ///< false: linearize throws
};

/// A backend on a device. A Backend and its Sessions belong to one thread at a time; several may work at once, each in
/// a thread of its own. Keep it as long as its Sessions.
class Backend {
public:
    virtual ~Backend() = default;
    [[nodiscard]] virtual BackendInfo info() const = 0;
    /// Makes the scene resident. Throws Error for an empty or too large grid, sizes that disagree, bad spacing or
    /// direction, voxels that are not finite, no views, bad cameras, a bad step, an image or mask with nothing to
    /// compare, and for memory that does not suffice. Views may lack images: then only render works.
    [[nodiscard]] virtual std::unique_ptr<Session> prepare(const Scene& scene) = 0;
    /// As Session::for_each_index, before there is a Session.
    virtual void for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn);
};

}  // namespace raylign
