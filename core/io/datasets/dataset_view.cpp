#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/text.h"
#include "core/io/datasets/datasets.h"
#include "core/io/datasets/hdf5_file.h"
#include "core/io/files/text.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign::detail {

GeometryView dataset_view(const Eigen::Matrix<double, 3, 4>& pixel_from_ct, const RigidTransform& ct_from_world,
                          const Eigen::Vector3d& x_ct_mm, const Eigen::Vector2i& size_px, double sdd_mm,
                          const std::string& where) {
    StoredProjection stored;
    stored.size_px = settled_size(size_px, {}, where);
    stored.sdd_mm = sdd_mm;
    const double depth = pixel_from_ct.row(2).head<3>().dot(x_ct_mm) + pixel_from_ct(2, 3);
    stored.pixel_from_world = (depth < 0 ? -1 : 1) * pixel_from_ct * to_matrix(ct_from_world);
    if (determinant_of(stored.pixel_from_world.leftCols<3>()) < 0) stored.own_flip = ImageFlip::columns;
    return finish_view(std::move(stored), {}, "", where);
}

DatasetIntrinsics read_intrinsics(const Hdf5File& file, const std::string& name, double column_mm, double row_mm) {
    DatasetIntrinsics result;
    result.matrix_px = file.matrix(name, 3, 3);
    const Eigen::Matrix3d& k = result.matrix_px;
    constexpr double kRounding = 1e-6;  // of files in single precision
    const bool is_triangular = std::abs(k(1, 0)) <= kRounding * std::abs(k(1, 1)) &&
                               (k.row(2) - Eigen::RowVector3d(0, 0, 1)).cwiseAbs().maxCoeff() <= kRounding;
    if (!is_triangular || k(0, 0) == 0 || k(1, 1) == 0) {
        throw Error(file.place(name) + ": must be an upper triangular matrix of intrinsics with 1 at its end");
    }
    const double by_columns = std::abs(k(0, 0)) * column_mm, by_rows = std::abs(k(1, 1)) * row_mm;
    constexpr double kTolerance = 0.01;
    if (std::abs(by_columns - by_rows) > kTolerance * by_columns) {
        throw bad_value("distance to the detector",
                        number_text(by_columns) + " mm by columns, " + number_text(by_rows) + " mm by rows",
                        "one distance: focal length [px] times pixel side", file.place(name));
    }
    result.sdd_mm = (by_columns + by_rows) / 2;
    return result;
}

std::string chosen_case(const std::string& wanted, const std::vector<std::string>& choices, const std::string& option,
                        const std::string& where) {
    if (choices.empty()) throw Error(where + " has no case of this data set in it");
    if (wanted.empty() && choices.size() == 1) return choices.front();
    if (std::ranges::find(choices, wanted) != choices.end()) return wanted;
    throw bad_value(option, wanted.empty() ? "none" : wanted, "one of " + joined(choices), where);
}

double positive_mm(double value_mm, const std::string& place) {
    constexpr double kLargest = 1000;
    if (value_mm > 0 && value_mm <= kLargest) return value_mm;
    throw bad_value("spacing", number_text(value_mm) + " mm", "in (0, 1000]", place);
}

}  // namespace raylign::detail
