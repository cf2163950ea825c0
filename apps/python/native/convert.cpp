#include "apps/python/native/convert.h"

#include <Eigen/LU>
#include <algorithm>
#include <memory>
#include <span>

#include "raylign/error.h"

namespace raylign::detail::python {
namespace {

template <class Number>
py::array_t<Number> in_c_order(const py::object& object, const std::string& what) {
    using Ordered = py::array_t<Number, py::array::c_style | py::array::forcecast>;
    return Ordered(real_array(object, what));
}

constexpr double kRoundedOff = 1e-13;  // of a rotation that raylign itself gave out

/// What raylign gave out comes back as it was, to the last bit: it is not made orthonormal once more.
RigidTransform pose_at(const double* values, const std::string& where) {
    const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values);
    const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
    const Eigen::Matrix3d deviation = rotation.transpose() * rotation - Eigen::Matrix3d::Identity();
    const bool is_one = matrix.allFinite() && matrix.row(3) == Eigen::RowVector4d::UnitW() &&
                        deviation.cwiseAbs().maxCoeff() < kRoundedOff && rotation.determinant() > 0;
    if (is_one) return {rotation, matrix.topRightCorner<3, 1>()};
    return rigid_from_matrix(matrix, where);
}

}  // namespace

py::array real_array(const py::object& object, const std::string& what) {
    const py::array array = py::array::ensure(object);
    if (!array) {
        PyErr_Clear();
        throw Error(what + ": must be an array of numbers, is a " +
                    py::str(py::type::of(object).attr("__name__")).cast<std::string>());
    }
    const char kind = array.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b') {
        throw Error(what + ": must be an array of real numbers, has dtype " +
                    py::str(array.dtype()).cast<std::string>());
    }
    return array;
}

py::array_t<double> numbers(const py::object& object, const std::string& what) {
    return in_c_order<double>(object, what);
}
py::array_t<float> floats(const py::object& object, const std::string& what) { return in_c_order<float>(object, what); }

std::string shape_text(const py::array& array) { return py::str(array.attr("shape")).cast<std::string>(); }

std::vector<double> numbers_of_shape(const py::object& object, const std::string& what,
                                     const std::vector<py::ssize_t>& shape) {
    const py::array_t<double> array = numbers(object, what);
    if (!std::ranges::equal(std::span(array.shape(), static_cast<std::size_t>(array.ndim())), shape)) {
        const py::tuple wanted(py::cast(shape));
        throw Error(what + ": must have the shape " + py::repr(wanted).cast<std::string>() + ", has " +
                    shape_text(array));
    }
    return {array.data(), array.data() + array.size()};
}

RigidTransform pose_from(const py::object& object, const std::string& what) {
    const py::array_t<double> array = numbers(object, what);
    if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4)
        throw Error(what + ": must have the shape (4, 4), has " + shape_text(array));
    return pose_at(array.data(), what);
}

std::vector<RigidTransform> poses_from(const py::object& object, const std::string& what) {
    const py::array_t<double> array = numbers(object, what);
    const py::ssize_t n = array.ndim();
    if ((n != 2 && n != 3) || array.shape(n - 1) != 4 || array.shape(n - 2) != 4)
        throw Error(what + ": must have the shape (4, 4) or (N, 4, 4), has " + shape_text(array));
    const py::ssize_t count = n == 3 ? array.shape(0) : 1;
    std::vector<RigidTransform> poses;
    poses.reserve(static_cast<std::size_t>(count));
    for (py::ssize_t i = 0; i < count; ++i)
        poses.push_back(pose_at(array.data() + 16 * i, n == 3 ? what + "[" + std::to_string(i) + "]" : what));
    return poses;
}

std::vector<Eigen::Vector3d> points_from(const py::object& object, const std::string& what) {
    const py::array_t<double> array = numbers(object, what);
    if (array.ndim() != 2 || array.shape(1) != 3)
        throw Error(what + ": must have the shape (N, 3), has " + shape_text(array));
    std::vector<Eigen::Vector3d> points;
    for (py::ssize_t i = 0; i < array.shape(0); ++i) points.emplace_back(array.data() + 3 * i);
    return points;
}

Eigen::Matrix4d matrix_of(const RigidTransform& b_from_a) { return to_matrix(b_from_a); }

py::array_t<double> points_array(const std::vector<Eigen::Vector3d>& points) {
    py::array_t<double> array({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
    for (std::size_t i = 0; i < points.size(); ++i)
        for (int axis = 0; axis < 3; ++axis) array.mutable_at(static_cast<py::ssize_t>(i), axis) = points[i][axis];
    return array;
}

Image image_from(const py::object& object, const std::string& what) {
    const py::array_t<float> array = floats(object, what);
    if (array.ndim() != 2 || array.size() == 0)
        throw Error(what + ": must have the shape (rows, columns), has " + shape_text(array));
    Image image;
    image.height = static_cast<int>(array.shape(0));
    image.width = static_cast<int>(array.shape(1));
    image.pixels.assign(array.data(), array.data() + array.size());
    return image;
}

py::object image_array(Image image) {
    if (image.empty()) return py::none();
    auto owner = std::make_unique<Image>(std::move(image));
    const Image& kept = *owner;
    const py::capsule life(owner.release(), [](void* pixels) { delete static_cast<Image*>(pixels); });
    return py::array_t<float>({kept.height, kept.width}, kept.pixels.data(), life);
}

}  // namespace raylign::detail::python
