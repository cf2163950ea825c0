#include "core/registration/trust/mirrored.h"

#include <algorithm>
#include <vector>

#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/registration/trust/verdict.h"

namespace raylign::detail {
namespace {

constexpr double kFarBetter = 0.15;  // of cost; a chest mirrored in one of two views lost 0.41
constexpr std::size_t kMostViews = 3;

void reverse_columns(Image& image) {
    for (int y = 0; y < image.height; ++y) {
        const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(image.index(0, y));
        std::reverse(row, row + image.width);
    }
}

std::string names_of(std::span<const View> views, unsigned subset) {
    std::vector<std::string> names;
    for (std::size_t v = 0; v < views.size(); ++v) {
        if (subset >> v & 1U) names.push_back(views[v].name);
    }
    return joined(names);
}

}  // namespace

View with_columns_reversed(View view) {
    if (!view.image.empty()) reverse_columns(view.image);
    if (!view.weights.empty()) reverse_columns(view.weights);
    return view;
}

std::optional<std::string> mirror_suspicion(std::span<const View> views, const RegistrationResult& found,
                                            const CostOfViews& cost_of) {
    if (views.size() > kMostViews) return std::nullopt;
    if (!has_weak_view(found)) return std::nullopt;
    double best_cost = found.cost_final - kFarBetter;
    unsigned best = 0;
    for (unsigned subset = 1; subset < 1U << views.size(); ++subset) {
        std::vector<View> mirrored(views.begin(), views.end());
        for (std::size_t v = 0; v < mirrored.size(); ++v) {
            if (subset >> v & 1U) mirrored[v] = with_columns_reversed(std::move(mirrored[v]));
        }
        const double cost = cost_of(mirrored);
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

}  // namespace raylign::detail
