#include "core/registration/strategy/part_weights.h"

#include <cmath>

#include "core/registration/level/pixel_weights.h"
#include "core/registration/policy.h"

namespace raylign::detail {

void weigh_part(Level& level, const RigidTransform& world_from_ct) {
    const double px = 1 / level.plan().pixel_at_object_mm;
    const int margin_px = static_cast<int>(std::ceil(kDomainMargin_mm * px)) + level.plan().filter.radius_px;
    std::vector<Image> weights = neighbourhood(level.session(), world_from_ct, margin_px);
    multiply(weights, local_normalisation(level.session(), kNormalisation_mm * px));
    level.session().set_weights(weights);
}

}  // namespace raylign::detail
