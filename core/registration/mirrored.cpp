#include "core/registration/mirrored.h"

#include <algorithm>
#include <vector>

#include "core/registration/number_text.h"
#include "core/registration/resident_volume.h"

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
        const RegistrationResult other = register_volume(volume, mirrored, start_world_from_ct, options, progress);
        if (!(other.cost_final < best_cost)) continue;
        best_cost = other.cost_final;
        best = subset;
    }
    if (best == 0) return std::nullopt;
    return "with the columns of " + names_of(views, best) + " reversed the images fit far better (cost " +
           fixed(best_cost, 2) + " against " + fixed(found.cost_final, 2) +
           "): mirrored? \"flip\": \"columns\" in views.json turns a view";
}

}  // namespace raylign
