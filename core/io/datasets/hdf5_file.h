#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/io/images/raster.h"

namespace raylign::detail {

/// An array of a HDF5 file in its own type. Half floats become floats, truth values 8-bit integers.
struct Hdf5Array {
    std::vector<std::size_t> shape;  ///< slowest first; empty = one value
    PixelType type = PixelType::f32;
    std::vector<std::byte> bytes;  ///< the last axis fastest
};

/// A HDF5 file that is read by paths such as "17-1882/vol/pixels". All errors name file and path. Sizes that the file
/// declares are believed only where its data can hold them. Each reading is done by a process of its own, which opens
/// the file again: nothing of a damaged file comes near this one.
class Hdf5File {
public:
    /// Throws Error for a file that is missing, damaged or no HDF5.
    explicit Hdf5File(const std::filesystem::path& path);

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    [[nodiscard]] bool has(const std::string& name) const;
    /// Names in a group, sorted. Throws Error where there is no such group.
    [[nodiscard]] std::vector<std::string> names(const std::string& group) const;

    /// Throws Error unless it is a dataset of numbers with `dimensions` axes, all with at least one element.
    [[nodiscard]] Hdf5Array array(const std::string& name, std::size_t dimensions) const;
    [[nodiscard]] double number(const std::string& name) const;  ///< one finite value, of any shape
    [[nodiscard]] std::string text(const std::string& name) const;
    /// `rows` x `columns` numbers, which may be NaN; axes of length 1 do not count.
    [[nodiscard]] Eigen::MatrixXd any_matrix(const std::string& name, int rows, int columns) const;
    /// The same of finite numbers.
    [[nodiscard]] Eigen::MatrixXd matrix(const std::string& name, int rows, int columns) const;
    [[nodiscard]] Eigen::VectorXd vector(const std::string& name, int size) const { return matrix(name, size, 1); }

    /// "<name> of <file>"
    [[nodiscard]] std::string place(const std::string& name) const;

private:
    std::filesystem::path path_;
};

}  // namespace raylign::detail
