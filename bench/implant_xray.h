#pragma once

#include <numbers>

#include "core/base/random.h"
#include "core/io/meshes/triangle_mesh.h"
#include "raylign/intensity.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"

namespace raylign::detail::bench {

inline constexpr double kDegree = std::numbers::pi / 180;

/// How X-rays of a model are simulated.
struct ImplantXray {
    int bits = 8;
    double blur_mm = 0, floor_share = 0.1, tissue = 1, photons_per_mm2 = 1.5e5;
    double clip = 0;   ///< share of the largest count that smaller ones are raised to: metal is flat to the count
    double black = 0;  ///< share of the largest count that is taken off all, down to 0: metal is black
};

/// Turned about `centre_mm` and moved, both evenly within a ball.
[[nodiscard]] RigidTransform moved(const RigidTransform& pose, const Eigen::Vector3d& centre_mm, double most_mm,
                                   double most_deg, Random& random);

/// Counts of the model at this pose: the exact length of each ray inside the triangles on 3 x 3 samples a pixel,
/// exp(-mu length) times what tissue of random soft lumps lets through, the detector's blur, quanta, a floor and whole
/// numbers.
[[nodiscard]] RawXray counts_of(const TriangleMesh& mesh, double mu_per_mm, const ViewGeometry& view,
                                const RigidTransform& pose, const ImplantXray& settings, int seed);

/// How they are to be read.
[[nodiscard]] IntensitySettings counts_read_as();

/// The view's camera with these counts as they are read, and the ceiling found in them.
[[nodiscard]] View shown_on(const TriangleMesh& mesh, double mu_per_mm, View view, const RigidTransform& pose,
                            const ImplantXray& settings, int seed);

}  // namespace raylign::detail::bench
