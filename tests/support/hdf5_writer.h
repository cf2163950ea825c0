#pragma once

#include <hdf5.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace raylign::detail::test {

/// Writes small HDF5 files as h5py does: datasets by paths, groups made on the way.
class Hdf5Writer {
public:
    explicit Hdf5Writer(const std::filesystem::path& path)
        : file_(checked(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT))),
          with_groups_(H5Pcreate(H5P_LINK_CREATE)) {
        H5Pset_create_intermediate_group(with_groups_, 1);
    }
    ~Hdf5Writer() {
        H5Pclose(with_groups_);
        H5Fclose(file_);
    }
    Hdf5Writer(const Hdf5Writer&) = delete;
    Hdf5Writer& operator=(const Hdf5Writer&) = delete;

    template <typename T>
    void array(const std::string& name, const std::vector<hsize_t>& shape, const std::vector<T>& values) const {
        const hid_t space = shape.empty() ? H5Screate(H5S_SCALAR)
                                          : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
        const hid_t set =
            checked(H5Dcreate2(file_, name.c_str(), type_of<T>(), space, with_groups_, H5P_DEFAULT, H5P_DEFAULT));
        checked(H5Dwrite(set, type_of<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
        H5Dclose(set);
        H5Sclose(space);
    }
    template <typename T>
    void number(const std::string& name, T value) const {
        array(name, {}, std::vector<T>{value});
    }
    void matrix(const std::string& name, const Eigen::MatrixXd& matrix) const {
        std::vector<double> values;
        for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
            for (Eigen::Index c = 0; c < matrix.cols(); ++c) values.push_back(matrix(r, c));
        }
        array(name, {static_cast<hsize_t>(matrix.rows()), static_cast<hsize_t>(matrix.cols())}, values);
    }
    /// A text of variable length.
    void text(const std::string& name, const std::string& value) const {
        const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
        H5Tset_size(type, H5T_VARIABLE);
        const hid_t set = checked(H5Dcreate2(file_, name.c_str(), type, space, with_groups_, H5P_DEFAULT, H5P_DEFAULT));
        const char* letters = value.c_str();
        checked(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &letters));
        H5Dclose(set);
        H5Sclose(space);
        H5Tclose(type);
    }
    /// A dataset that declares `shape` and has no data.
    void hollow(const std::string& name, const std::vector<hsize_t>& shape) const {
        const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
        const hid_t create = H5Pcreate(H5P_DATASET_CREATE);
        const std::vector<hsize_t> chunk(shape.size(), 16);
        H5Pset_chunk(create, static_cast<int>(chunk.size()), chunk.data());
        H5Dclose(checked(H5Dcreate2(file_, name.c_str(), H5T_NATIVE_FLOAT, space, with_groups_, create, H5P_DEFAULT)));
        H5Pclose(create);
        H5Sclose(space);
    }

private:
    template <typename Result>
    static Result checked(Result result) {
        if (result < 0) throw std::runtime_error("HDF5 cannot write the test's file");
        return result;
    }
    template <typename T>
    static hid_t type_of() {
        if constexpr (std::is_same_v<T, float>) return H5T_NATIVE_FLOAT;
        if constexpr (std::is_same_v<T, double>) return H5T_NATIVE_DOUBLE;
        if constexpr (std::is_same_v<T, std::uint8_t>) return H5T_NATIVE_UINT8;
        if constexpr (std::is_same_v<T, std::int16_t>) return H5T_NATIVE_INT16;
        if constexpr (std::is_same_v<T, std::uint16_t>) return H5T_NATIVE_UINT16;
        return H5T_NATIVE_INT64;
    }

    hid_t file_, with_groups_;
};

}  // namespace raylign::detail::test
