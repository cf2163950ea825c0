#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/gl/context.h"

namespace raylign::detail::bench {

/// How voxels are asked for along rays as joseph casts them.
enum class Fetch {
    texture,             ///< by the texture unit's filter: DRRs
    texture_four,        ///< the same, four planes at a time
    gather,              ///< four texels, value and slopes in the shader: DRRs with derivatives
    gather_and_texture,  ///< both
    texture_3d,          ///< the filter of a 3-D texture
};
inline constexpr Fetch kFetches[] = {Fetch::texture, Fetch::texture_four, Fetch::gather, Fetch::gather_and_texture,
                                     Fetch::texture_3d};
[[nodiscard]] std::string_view fetch_name(Fetch fetch);

/// Rays of `images` images of side_px^2 through noise of voxels^3; most samples a second of several turns, by the
/// device's clock.
struct CeilingScene {
    int voxels = 256, side_px = 256, images = 1;
    bool float_texels = false;  ///< else normalized 16-bit ones, as the backend's default
};
[[nodiscard]] double samples_per_s(gl::Context& context, Fetch fetch, const CeilingScene& scene);

/// Bytes a second that a shader reads and writes, each counted.
[[nodiscard]] double copied_bytes_per_s(gl::Context& context, std::size_t bytes);

/// A dispatch of nothing, a fence, and the wait for it [s], median.
[[nodiscard]] double round_trip_s(gl::Context& context);

}  // namespace raylign::detail::bench
