#include "core/tracking/quick_way.h"

#include <algorithm>

#include "core/base/median.h"

namespace raylign::detail {
namespace {

constexpr int kConfirmed = 2;
constexpr std::size_t kLately = 15;
constexpr double kQuickFloor = 0.03, kQuickShare = 0.25;  // noise; and how much costs change along a motion

void push_costs(std::vector<std::vector<double>>& costs, const std::vector<double>& of_views) {
    costs.push_back(of_views);
    if (costs.size() > kLately) costs.erase(costs.begin());
}

double usual(const std::vector<std::vector<double>>& costs, std::size_t view) {
    std::vector<double> of_view;
    for (const std::vector<double>& of_views : costs) of_view.push_back(of_views.at(view));
    return median(std::move(of_view));
}

}  // namespace

bool QuickWay::is_confirmed() const { return is_open() && agreed_ >= kConfirmed; }

bool QuickWay::is_usual(std::span<const double> view_costs) const {
    for (std::size_t v = 0; v < view_costs.size(); ++v) {
        // Neither at once nor little by little.
        const double known = usual(compared_, v), late = lately_.empty() ? known : usual(lately_, v);
        if (!(view_costs[v] <= std::min(2 * known, late) + kQuickFloor + kQuickShare * late)) return false;
    }
    return true;
}

double QuickWay::drift() const {
    double largest = 1;
    for (std::size_t v = 0; !lately_.empty() && v < lately_.front().size(); ++v) {
        largest = std::max(largest, usual(lately_, v) / std::max(usual(compared_, v), kQuickFloor));
    }
    return largest;
}

double QuickWay::error_ratio() const { return error_ratios_.empty() ? 1 : median(error_ratios_); }

void QuickWay::remember(const TrackFrame& found) {
    if (found.quick_view_costs.empty() || found.status != TrackStatus::ok) return;
    if (found.quick) {
        if (is_confirmed()) push_costs(lately_, found.quick_view_costs);  // a chain may begin with another's frame
    } else if (found.quick_agrees) {
        ++agreed_;
        push_costs(compared_, found.quick_view_costs);
        error_ratios_.push_back(found.quick_error_ratio);
    } else {
        --coarser_by_;
        agreed_ = 0;
        compared_.clear();
        lately_.clear();
        error_ratios_.clear();
    }
}

}  // namespace raylign::detail
