#pragma once

#include <string_view>

#include "raylign/camera.h"

namespace raylign::detail {

/// The camera of the image that averages 2x2 pixels: pixel i of it covers 2i and 2i + 1, so u' = (u - 1/2) / 2.
[[nodiscard]] Camera half_resolution(const Camera& camera);

/// The camera with n x n pixels in place of each.
[[nodiscard]] Camera finer(Camera camera, int n);

/// Throws Error for a size below 1, focal lengths that are not positive and finite, or a bad sdd. `where` is named.
void check_camera(const Camera& camera, std::string_view where);

}  // namespace raylign::detail
