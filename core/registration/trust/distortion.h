#pragma once

#include <string_view>

#include "raylign/image.h"

namespace raylign::detail {

/// What real X-rays have and a DRR has not; see model_error.h.
enum class Distortion { blur, scatter, hardening };
inline constexpr int kDistortions = 3;

[[nodiscard]] std::string_view distortion_name(Distortion distortion);

/// A DRR I as it would be with that, at ordinary amounts:
///   blur       -log(G * exp(-I)),                              G a Gaussian of 0.6 pixels,
///   scatter    -log((exp(-I) + s S * exp(-I)) / (1 + s)),      s = 0.4, S a Gaussian of a tenth of the image's width,
///   hardening  I / (1 + 0.06 I).
[[nodiscard]] Image distorted(Distortion distortion, const Image& drr);

}  // namespace raylign::detail
