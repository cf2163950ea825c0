#pragma once

#include "raylign/image.h"

namespace raylign::detail {

/// Weights 1 within the field of view, 0 outside and within 2 px of its edge; empty where no field is framed. It is
/// framed where the image's dark border ends in a circle about the image's middle (a round field of view) or in a
/// rectangle along the image's sides (a collimator): the detector's field rather than the outline of a body in dark
/// air. Walks inwards from the border along rays until a pixel exceeds `dark_below`. Pixels of weight 0 count as dark;
/// empty weights = all ones.
[[nodiscard]] Image field_of_view_weights(const Image& image, const Image& weights, float dark_below);

}  // namespace raylign::detail
