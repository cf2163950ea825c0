#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/backend.h"
#include "core/base/error.h"
#include "core/base/for_each.h"
#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"
#include "core/descent.h"
#include "core/surface/surface_drr.h"

namespace raylign {
using namespace detail;
namespace {

/// Multiplies the new weights of a view by those of its mask.
void apply_mask(Image& weights, const Image& mask, std::size_t view) {
    const std::string where = "view " + std::to_string(view);
    if (weights.width != mask.width || weights.height != mask.height) {
        throw bad_value("weight image size", std::to_string(weights.width) + " x " + std::to_string(weights.height),
                        std::to_string(mask.width) + " x " + std::to_string(mask.height) + " as the view", where);
    }
    std::size_t usable = 0;
    for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
        if (!(weights.pixels[i] >= 0 && std::isfinite(weights.pixels[i]))) {
            throw bad_value("weight", number_text(weights.pixels[i]), "finite and not negative", where);
        }
        weights.pixels[i] *= mask.pixels[i];
        if (weights.pixels[i] > 0) ++usable;
    }
    if (usable < kMinPixels) {
        throw bad_value("pixels with weight", std::to_string(usable), "at least " + std::to_string(kMinPixels), where);
    }
}

void check_source(const RayFrame& frame) {
    const double farthest = frame.source_voxel.cwiseAbs().maxCoeff();
    if (frame.source_voxel.allFinite() && farthest <= kFarthestSource_voxels) return;
    throw bad_value("distance between source and volume", vector_text(frame.source_voxel) + " voxels",
                    "below 1e9 voxels", "pose " + std::to_string(frame.pose) + ", view " + std::to_string(frame.view));
}

void check_centre(const Eigen::Vector3d& centre_ct_mm) {
    if (!centre_ct_mm.allFinite()) throw bad_value("rotation centre", vector_text(centre_ct_mm) + " mm", "finite");
}

DescentView descent_view(const ViewGeometry& view, double ceiling, double share) {
    const RigidTransform world_from_camera = inverse(view.camera_from_world);
    return {.source_world_mm = world_from_camera.translation_mm,
            .world_from_pixel = world_from_camera.rotation * inverse_of(view.camera.intrinsics_px),
            .depth_max_mm = view.camera.sdd_mm.value_or(std::numeric_limits<double>::infinity()),
            .ceiling = ceiling,
            .share = share};
}

}  // namespace

Session::~Session() = default;

Session::Session(const Scene& scene)
    : grid_(scene.volume.grid),
      similarity_(scene.similarity),
      channel_count_(detail::channel_count(scene.similarity.metric)) {
    check_scene(scene);
    if (scene.volume.surface) surface_ = std::make_shared<const SurfaceDrr>(*scene.volume.surface, grid_);
    take_views(scene.views);
}

Session::Session(const Session& resident, std::span<const View> views, const Similarity& similarity)
    : grid_(resident.grid_),
      surface_(resident.surface_),
      similarity_(similarity),
      channel_count_(detail::channel_count(similarity.metric)) {
    check_views(views);
    take_views(views);
}

void Session::take_views(std::span<const View> views) {
    double weight_sum = 0;
    for (const View& view : views) weight_sum += view.cost_weight;
    for (const View& view : views) {
        views_.push_back(view.geometry);
        view_shares_.push_back(view.cost_weight / weight_sum);
        ceilings_.push_back(view.ceiling);
    }
    for (const View& view : views) {
        if (view.image.empty()) {  // drr and study simulate images: no costs without all of them
            fixed_.clear();
            break;
        }
        fixed_.push_back(make_fixed_channels(view, similarity_));
        mask_weights_.push_back(fixed_.back().weights);
    }
}

void Session::set_weights(std::span<const Image> weights) {
    if (fixed_.empty()) throw Error("set_weights: every view needs an image");
    if (weights.size() != fixed_.size()) {
        throw bad_value("number of weight images", std::to_string(weights.size()),
                        std::to_string(fixed_.size()) + ", the number of views");
    }
    std::vector<Image> usable(weights.begin(), weights.end());
    for (std::size_t v = 0; v < usable.size(); ++v) apply_mask(usable[v], mask_weights_[v], v);
    for (std::size_t v = 0; v < usable.size(); ++v) fixed_[v].weights = std::move(usable[v]);
    ++weight_changes_;
    weights_changed();
}

const FixedChannels& Session::fixed_channels(std::size_t view) const {
    if (fixed_.empty()) throw Error("fixed_channels: every view needs an image");
    return fixed_.at(view);
}

std::vector<Image> Session::moving_channels(const RigidTransform& world_from_ct, std::size_t view) {
    return channels_of(render(world_from_ct, view));
}

std::vector<Image> Session::channels_of(const Image& image) const {
    return detail::moving_channels(image, similarity_);
}

std::vector<RayFrame> Session::frames_for(std::span<const RigidTransform> world_from_ct) const {
    for (std::size_t i = 0; i < world_from_ct.size(); ++i) {
        // Backends turn NaN coordinates into plausible numbers (comparisons fail, clamps hold): stop them here.
        if (!is_finite(world_from_ct[i])) throw Error("pose " + std::to_string(i) + ": must be finite");
    }
    std::vector<RayFrame> frames = make_ray_frames(grid_, views_, world_from_ct);
    for (RayFrame& frame : frames) {
        check_source(frame);
        frame.ceiling = ceilings_[frame.view];
    }
    return frames;
}

std::vector<MomentSums> Session::moment_sums(std::span<const RigidTransform> world_from_ct) {
    if (fixed_.empty()) throw Error("evaluate: every view needs an image");
    const std::vector<RayFrame> frames = frames_for(world_from_ct);
    std::vector<MomentSums> sums(frames.size() * channel_count_);
    if (!frames.empty()) accumulate(frames, sums);
    counters_.evaluations += world_from_ct.size();
    return sums;
}

void Session::evaluate(std::span<const RigidTransform> world_from_ct, std::span<double> costs) {
    if (costs.size() != world_from_ct.size()) {
        throw bad_value("number of costs", std::to_string(costs.size()),
                        std::to_string(world_from_ct.size()) + ", the number of poses");
    }
    const std::vector<MomentSums> sums = moment_sums(world_from_ct);
    std::span<const MomentSums> rest = sums;
    for (double& cost : costs) {
        cost = 0;
        for (std::size_t view = 0; view < view_count(); ++view, rest = rest.subspan(channel_count_)) {
            cost += view_shares_[view] * view_cost(rest.first(channel_count_));
        }
    }
}

void Session::linearize(std::span<const RigidTransform> world_from_ct, const Eigen::Vector3d& centre_ct_mm,
                        std::span<Linearization> results) {
    if (results.size() != world_from_ct.size()) {
        throw bad_value("number of results", std::to_string(results.size()),
                        std::to_string(world_from_ct.size()) + ", the number of poses");
    }
    std::vector<Linearization> of_views(world_from_ct.size() * view_count());
    linearize_views(world_from_ct, centre_ct_mm, of_views);
    auto of_view = of_views.cbegin();
    for (Linearization& result : results) {
        result = {};
        for (const double share : view_shares_) {
            result += {share * of_view->cost, share * of_view->gradient, share * of_view->curvature};
            ++of_view;
        }
    }
}

void Session::linearize_views(std::span<const RigidTransform> world_from_ct, const Eigen::Vector3d& centre_ct_mm,
                              std::span<Linearization> results) {
    if (results.size() != world_from_ct.size() * view_count()) {
        throw bad_value("number of results", std::to_string(results.size()),
                        std::to_string(world_from_ct.size() * view_count()) + ", one for each pose and view");
    }
    if (fixed_.empty()) throw Error("linearize: every view needs an image");
    check_centre(centre_ct_mm);
    const std::vector<RayFrame> frames = frames_for(world_from_ct);
    std::vector<RayFrameDerivatives> derivatives;
    derivatives.reserve(frames.size());
    for (const RigidTransform& pose : world_from_ct) {
        for (const ViewGeometry& view : views_) {
            derivatives.push_back(make_ray_frame_derivatives(grid_, view, pose, pose * centre_ct_mm));
        }
    }
    std::vector<JacobianSums> sums(frames.size() * channel_count_);
    if (!frames.empty()) accumulate(frames, derivatives, sums);
    counters_.linearizations += world_from_ct.size();
    std::span<const JacobianSums> rest = sums;
    for (Linearization& result : results) {
        result = linearize_view(rest.first(channel_count_));
        rest = rest.subspan(channel_count_);
    }
}

std::optional<std::vector<DescentEnd>> Session::descend(const DescentProblem& problem,
                                                        std::span<const DescentStart> starts) {
    if (fixed_.empty()) throw Error("descend: every view needs an image");
    check_centre(problem.centre_ct_mm);
    if (!descends()) return std::nullopt;
    if (const std::string fault = problem.options.problem(); !fault.empty()) throw Error(fault);
    if (starts.empty()) return std::vector<DescentEnd>{};
    std::vector<DescentView> views;
    for (std::size_t v = 0; v < views_.size(); ++v) {
        views.push_back(descent_view(views_[v], ceilings_[v], view_shares_[v]));
    }
    std::vector<RigidTransform> poses;
    for (const DescentStart& start : starts) poses.push_back(start.world_from_ct);
    std::vector<DescentEnd> ends = run_descents(problem, views, starts, frames_for(poses));
    for (const DescentEnd& end : ends) {
        counters_.linearizations += static_cast<std::uint64_t>(end.linearizations);
        if (end.refused) (void)frames_for({&*end.refused, 1});  // says what is wrong with it
    }
    return ends;
}

std::vector<DescentEnd> Session::run_descents(const DescentProblem&, std::span<const DescentView>,
                                              std::span<const DescentStart>, std::span<const RayFrame>) {
    throw Error("this backend leaves descents to its caller");
}

void Session::check_view_index(std::size_t view) const {
    if (view >= view_count()) {
        throw bad_value("view", std::to_string(view), "below " + std::to_string(view_count()));
    }
}

Image Session::render(const RigidTransform& world_from_ct, std::size_t view) {
    check_view_index(view);
    return render_frame(frames_for({&world_from_ct, 1})[view]);
}

DrrWithDerivatives Session::render_with_derivatives(const RigidTransform& world_from_ct,
                                                    const Eigen::Vector3d& centre_ct_mm, std::size_t view) {
    check_view_index(view);
    check_centre(centre_ct_mm);
    const RayFrame frame = frames_for({&world_from_ct, 1})[view];
    return render_frame(frame,
                        make_ray_frame_derivatives(grid_, views_[view], world_from_ct, world_from_ct * centre_ct_mm));
}

void Session::for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) { in_order(count, turn); }

void Backend::for_each_index(std::size_t count, const std::function<void(std::size_t)>& turn) { in_order(count, turn); }

}  // namespace raylign
