#pragma once

#include <limits>
#include <string>

#include "raylign/camera.h"
#include "raylign/image.h"

namespace raylign {

/// One X-ray and its geometry.
struct View {
    std::string name;
    ViewGeometry geometry;
    Image image;             ///< line integrals (denser = larger); empty where there is none yet (drr, study)
    Image weights;           ///< 0 = ignore this pixel, 1 = use it; empty = all ones
    double cost_weight = 1;  ///< share of this view in the cost, relative to the other views'; positive
    /// Where the detector saturates: it never shows more than this line integral c, and of a DRR's I what is left where
    /// at least the share f = exp(-c) of the beam arrives, -log(f + (1 - f) exp(-I)). Positive; infinite = nowhere.
    double ceiling = std::numeric_limits<double>::infinity();
    /// Registered by the share of the beam that arrives, instead of by its logarithm: for objects that let hardly
    /// anything through. A detector's blur moves the edge of metal inwards in line integrals, as they grow fastest
    /// where least arrives, and not in what arrives.
    bool by_transmission = false;
};

}  // namespace raylign
