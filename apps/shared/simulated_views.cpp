#include "apps/shared/simulated_views.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/geometry/camera.h"
#include "raylign/backends.h"

namespace raylign::detail::apps {
namespace {

constexpr int kFiner = 3;             // pixels along each of a model's, which have 2 x 2 rays themselves
constexpr double kStep_voxels = 0.4;  // finer than the registration's, and no divisor of it

/// What pixels show of a surface on average of many more rays than the registration has.
Image finely_drawn(Session& finer_session, const RigidTransform& pose, std::size_t view, const View& shown) {
    const Image fine = finer_session.render(pose, view);
    const double floor = std::exp(-shown.ceiling);
    Image image(shown.geometry.camera.size_px.x(), shown.geometry.camera.size_px.y());
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            double arriving = 0;
            for (int k = 0; k < kFiner * kFiner; ++k) {
                arriving += std::exp(-double{fine(kFiner * x + k % kFiner, kFiner * y + k / kFiner)});
            }
            image(x, y) = static_cast<float>(-std::log(floor + (1 - floor) * arriving / (kFiner * kFiner)));
        }
    }
    return image;
}

/// Of a model: its triangles, but not by the same rays. Else a projector that the registration does not use.
std::vector<Image> simulated(const Volume& volume, std::span<const View> views, const RigidTransform& pose,
                             const RenderSettings& other) {
    std::vector<View> drawn(views.begin(), views.end());
    for (View& view : drawn) {
        if (!volume.surface) continue;
        view.geometry.camera = finer(view.geometry.camera, kFiner);
        view.weights = {};
        view.ceiling = std::numeric_limits<double>::infinity();
    }
    const auto session = simulation_backend()->prepare({volume, drawn, other, {}});
    std::vector<Image> images;
    for (std::size_t v = 0; v < views.size(); ++v) {
        images.push_back(volume.surface ? finely_drawn(*session, pose, v, views[v]) : session->render(pose, v));
    }
    return images;
}

}  // namespace

std::unique_ptr<Backend> simulation_backend() {
    const std::vector<std::string> names = backend_names();
    const bool has_cpu = std::ranges::find(names, "cpu") != names.end();
    return create_backend(has_cpu ? "cpu" : "reference").backend;
}

SimulatedViews simulate_missing_images(const Volume& volume, std::vector<View>& views,
                                       const RigidTransform& true_world_from_ct, Projector registers_by) {
    SimulatedViews result;
    std::vector<View> missing;
    for (const View& view : views) {
        result.is_simulated.push_back(view.image.empty() ? 1 : 0);
        if (view.image.empty()) missing.push_back(view);
    }
    if (missing.empty()) return result;
    RenderSettings other{Projector::joseph, {}};
    if (registers_by == Projector::joseph) {
        other = {Projector::trilinear, kStep_voxels * volume.grid.spacing_mm.minCoeff()};
        result.how = ", steps of 0.4 voxels";
    }
    result.how = "projector " + std::string(projector_name(other.projector)) + result.how + ", full grid of the CT";
    if (volume.surface) result.how = "from the triangles of the model, 6 x 6 rays a pixel";
    const std::vector<Image> images = simulated(volume, missing, true_world_from_ct, other);
    std::size_t next = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
        if (result.is_simulated[v] != 0) views[v].image = images[next++];
    }
    return result;
}

}  // namespace raylign::detail::apps
