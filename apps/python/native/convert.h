#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <string>
#include <vector>

#include "raylign/image.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail::python {

namespace py = pybind11;

/// Anything that NumPy takes for an array of real numbers, as floats or doubles in C order: the array itself where it
/// is one already, else a copy. Throws Error for other types, naming `what`.
[[nodiscard]] py::array_t<double> numbers(const py::object& object, const std::string& what);
[[nodiscard]] py::array_t<float> floats(const py::object& object, const std::string& what);

/// The same as they are, of any type of real numbers and in any order in memory.
[[nodiscard]] py::array real_array(const py::object& object, const std::string& what);

/// "(256, 256)": for messages.
[[nodiscard]] std::string shape_text(const py::array& array);

/// The numbers of an array of this shape, row by row. Throws Error for another.
[[nodiscard]] std::vector<double> numbers_of_shape(const py::object& object, const std::string& what,
                                                   const std::vector<py::ssize_t>& shape);
template <int kSize>
[[nodiscard]] Eigen::Matrix<double, kSize, 1> vector_from(const py::object& object, const std::string& what) {
    return Eigen::Matrix<double, kSize, 1>(numbers_of_shape(object, what, {kSize}).data());
}
template <int kRows, int kColumns>
[[nodiscard]] Eigen::Matrix<double, kRows, kColumns> matrix_from(const py::object& object, const std::string& what) {
    using RowByRow = Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>;
    return Eigen::Map<const RowByRow>(numbers_of_shape(object, what, {kRows, kColumns}).data());
}

/// A 4 x 4 matrix. Throws Error for another shape and a matrix that is not rigid.
[[nodiscard]] RigidTransform pose_from(const py::object& object, const std::string& what);
/// One or several: (4, 4) or (N, 4, 4).
[[nodiscard]] std::vector<RigidTransform> poses_from(const py::object& object, const std::string& what);
/// (N, 3) as points.
[[nodiscard]] std::vector<Eigen::Vector3d> points_from(const py::object& object, const std::string& what);

[[nodiscard]] Eigen::Matrix4d matrix_of(const RigidTransform& b_from_a);
[[nodiscard]] py::array_t<double> points_array(const std::vector<Eigen::Vector3d>& points);

/// (rows, columns), line integrals or weights. Throws Error for another shape.
[[nodiscard]] Image image_from(const py::object& object, const std::string& what);
/// The pixels themselves, not a copy; None for an empty image.
[[nodiscard]] py::object image_array(Image image);

}  // namespace raylign::detail::python
