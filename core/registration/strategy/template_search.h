#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/registration/strategy/candidates.h"
#include "raylign/view.h"

namespace raylign::detail {

/// What a template search covers.
struct TemplateRange {
    double turn_rad = 0;    ///< largest turn from the nominal orientation
    double reach_mm = 0;    ///< how far turn and shift together may move the rim; 0 = wherever all views see the centre
    double spacing_mm = 0;  ///< of neighbouring places: a pixel at the object
};

struct TemplateFits {
    std::vector<Candidate> best;  ///< best first; cost is 1 - score
    std::int64_t tried = 0;       ///< orientations times places
};

/// Exhaustive search over orientations and places at the price of one DRR per orientation and view: the object's
/// gradient image M is a template that is moved over the X-ray's gradient image F. Per view and shift s
///   score = sum w F(p + s) M(p) / sqrt((sum w F(p + s)^2 + f) sum M(p)^2),
/// sums over the template's pixels p and channels, which is gradient correlation on the object's own pixels (f: a
/// tenth of the view's mean energy per template pixel, so that empty background does not fit everything; what lies
/// beyond the usable pixels counts as not found). A place in space scores the mean over views of the score where it is
/// projected to. Orientations: a lattice in the ball of rotation vectors, none of whose points is farther than 6.5
/// degrees from the next. What this leaves out - perspective and magnification change as the object moves off its
/// nominal place - is within the reach of a refinement. One view does not tell depth: then only places at the nominal
/// depth are tried.
///
/// Uses the session's weights and the backend's threads. Gives the `count` best, no two of one orientation closer than
/// three spacings; the same for any number of threads; places lie farther apart than asked for where there would be
/// more than 4 million. None where the object's centre is seen by all views at no place. `progress` is called now and
/// then with the share done; it may throw to stop.
[[nodiscard]] TemplateFits poses_by_templates(Session& session, std::span<const View> views,
                                              const RigidTransform& nominal, const ObjectExtent& extent,
                                              const TemplateRange& range, std::size_t count,
                                              const std::function<void(double)>& progress);

}  // namespace raylign::detail
