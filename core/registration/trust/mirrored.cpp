#include "core/registration/trust/mirrored.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/registration/object/resident_volume.h"

namespace raylign {
namespace {

constexpr double kWeakCost = 0.5;    // a right pose of a whole is below, and most of a part
constexpr double kFarBetter = 0.15;  // of cost; a chest mirrored in one of two views lost 0.41
constexpr std::size_t kMostViews = 3;

void reverse_columns(Image& image) {
    for (int y = 0; y < image.height; ++y) {
        const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(image.index(0, y));
        std::reverse(row, row + image.width);
    }
}

std::string names_of(std::span<const View> views, unsigned subset) {
    std::string names;
    for (std::size_t v = 0; v < views.size(); ++v) {
        if (subset >> v & 1U) names += (names.empty() ? "" : ", ") + views[v].name;
    }
    return names;
}

/// Of a registration; not a number where there is none, as where the mirrored mask leaves nothing of the DRR.
double cost_of(ResidentVolume& volume, std::span<const View> views, const RigidTransform& start_world_from_ct,
               const RegistrationOptions& options, const ProgressCallback& progress) {
    try {
        return register_volume(volume, views, start_world_from_ct, options, progress).cost_final;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::input) throw;
        return std::numeric_limits<double>::quiet_NaN();
    }
}

}  // namespace

View with_columns_reversed(View view) {
    if (!view.image.empty()) reverse_columns(view.image);
    if (!view.weights.empty()) reverse_columns(view.weights);
    return view;
}

std::optional<std::string> mirror_suspicion(ResidentVolume& volume, std::span<const View> views,
                                            const RigidTransform& start_world_from_ct,
                                            const RegistrationOptions& options, const RegistrationResult& found,
                                            const ProgressCallback& progress) {
    if (views.size() > kMostViews) return std::nullopt;
    if (std::ranges::none_of(found.view_costs, [](double cost) { return !(cost < kWeakCost); })) return std::nullopt;
    double best_cost = found.cost_final - kFarBetter;
    unsigned best = 0;
    for (unsigned subset = 1; subset < 1U << views.size(); ++subset) {
        std::vector<View> mirrored(views.begin(), views.end());
        for (std::size_t v = 0; v < mirrored.size(); ++v) {
            if (subset >> v & 1U) mirrored[v] = with_columns_reversed(std::move(mirrored[v]));
        }
        const double cost = cost_of(volume, mirrored, start_world_from_ct, options, progress);
        if (!(cost < best_cost)) continue;
        best_cost = cost;
        best = subset;
    }
    if (best == 0) return std::nullopt;
    return "with the columns of " + names_of(views, best) + " reversed the images fit far better (cost " +
           fixed(best_cost, 2) + " against " + fixed(found.cost_final, 2) +
           "): mirrored? \"flip\": \"columns\" in views.json turns a view. Or the start is far off: a global search "
           "needs none";
}

}  // namespace raylign
