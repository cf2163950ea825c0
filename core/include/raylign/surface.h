#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace raylign {

/// Closed surfaces of triangles around bodies of uniform attenuation: what a model is, exactly, where voxels only come
/// near. Where bodies lie in one another their attenuations add up.
struct Surface {
    std::vector<Eigen::Vector3d> vertices_mm;            ///< ct frame
    std::vector<std::array<std::int32_t, 3>> triangles;  ///< of vertices, counter-clockwise seen from outside
    std::vector<float> attenuation_per_mm;               ///< per triangle: of the body that it bounds
};

}  // namespace raylign
