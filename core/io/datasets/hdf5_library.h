#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/io/datasets/hdf5_file.h"

namespace raylign::detail {

/// "3 x 4"; "one value" of no axes.
[[nodiscard]] std::string shape_words(const std::vector<std::size_t>& shape);

/// A HDF5 file as the library reads it, in this process: what a damaged one does to the library, it does to the
/// program. For the decoder of Hdf5File alone.
class Hdf5Library {
public:
    /// Throws Error for a file that is damaged or no HDF5.
    explicit Hdf5Library(const std::filesystem::path& path);
    ~Hdf5Library();
    Hdf5Library(const Hdf5Library&) = delete;
    Hdf5Library& operator=(const Hdf5Library&) = delete;

    [[nodiscard]] bool has(const std::string& name) const;
    [[nodiscard]] std::vector<std::string> names(const std::string& group) const;
    [[nodiscard]] Hdf5Array array(const std::string& name) const;  ///< any dataset of numbers
    [[nodiscard]] std::string text(const std::string& name) const;

private:
    [[nodiscard]] std::string place(const std::string& name) const;

    struct Handles;
    std::filesystem::path path_;
    std::unique_ptr<Handles> handles_;
};

}  // namespace raylign::detail
