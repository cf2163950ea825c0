#include "apps/shared/simulated_views.h"

#include <algorithm>

#include "raylign/backends.h"

namespace raylign::detail::apps {
namespace {

constexpr double kStep_voxels = 0.4;  // finer than the registration's, and no divisor of it

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
    const auto session = simulation_backend()->prepare({volume, missing, other, {}});
    std::size_t next = 0;
    for (std::size_t v = 0; v < views.size(); ++v) {
        if (result.is_simulated[v] != 0) views[v].image = session->render(true_world_from_ct, next++);
    }
    return result;
}

}  // namespace raylign::detail::apps
