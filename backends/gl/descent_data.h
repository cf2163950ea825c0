#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "backends/gl/shared.h"
#include "core/descent.h"
#include "core/similarity/similarity.h"
#include "raylign/grid.h"

namespace raylign::detail::gl {

// What searches that the device runs by itself travel as, and back.

/// Row by row.
template <int rows, int columns>
void put(double* to, const Eigen::Matrix<double, rows, columns>& matrix) {
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) *to++ = matrix(i, j);
    }
}
[[nodiscard]] RigidTransform pose_of(const double* from);

[[nodiscard]] shared::ViewModel model_of(const Linearization& at);
[[nodiscard]] Linearization linearization_of(const shared::ViewModel& model);

/// A search that has not begun.
[[nodiscard]] shared::SearchData search_from(const DescentStart& start, double damping);
/// `static_sums`: [view][channel].
[[nodiscard]] std::vector<shared::CameraData> cameras_of(std::span<const DescentView> views,
                                                         std::span<const MomentSums> static_sums);
/// All but the numbers of things and the volume's box on the device.
[[nodiscard]] shared::DescentData rules_of(const DescentProblem& problem, const VoxelGrid& grid);

}  // namespace raylign::detail::gl
