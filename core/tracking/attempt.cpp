#include "core/tracking/attempt.h"

#include <array>
#include <optional>
#include <utility>

#include "core/registration/policy.h"

namespace raylign::detail {
namespace {

struct Widening {
    Search mode;
    std::optional<double> range_mm, range_deg;
    std::optional<int> starts;
};
constexpr std::array<Widening, 3> kWidenings{{{Search::near, kNearRange_mm, 30, 1024},
                                              {Search::near, 2 * kNearRange_mm, kNearTurn_deg, kNearStarts},
                                              {Search::global, {}, {}, {}}}};

}  // namespace

std::vector<RegistrationOptions> wider_searches(const RegistrationOptions& first, Search widest) {
    std::vector<RegistrationOptions> list;
    if (widest == Search::none || first.search.mode == Search::global) return list;
    for (const Widening& widening : kWidenings) {
        if (widening.mode == Search::global && widest == Search::near) break;
        RegistrationOptions options = first;
        options.method = Method::automatic;  // searches refine by gauss-newton
        options.search.mode = widening.mode;
        options.search.range_mm = widening.range_mm;
        options.search.range_deg = widening.range_deg;
        options.search.starts = widening.starts;
        list.push_back(std::move(options));
    }
    return list;
}

}  // namespace raylign::detail
