#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace raylign::detail {

/// A FileStorage file: maps names to matrices and numbers. Several programs spell them differently.
class OpencvFile {
public:
    /// Throws Error for a file above 1 MB (no calibration is; the parser takes a hundredfold) and one that is no map.
    explicit OpencvFile(const std::filesystem::path& path);

    [[nodiscard]] bool has(const std::string& name) const { return static_cast<bool>(root_[name]); }
    [[nodiscard]] std::vector<std::string> names() const;
    /// The first of `names` that the file has; "" for none.
    [[nodiscard]] std::string first_of(std::span<const std::string_view> names) const;
    [[nodiscard]] std::string need(std::span<const std::string_view> names) const;

    [[nodiscard]] double number(const std::string& name) const { return number_of(root_[name], name); }
    /// A scalar; "" where it is none.
    [[nodiscard]] std::string text(const std::string& name) const;
    /// A matrix (rows, cols, data), a list of rows, or a plain list of numbers as one column.
    [[nodiscard]] Eigen::MatrixXd matrix(const std::string& name) const;
    /// The same with as many rows and columns; a plain list of as many numbers is taken row by row.
    [[nodiscard]] Eigen::MatrixXd matrix(const std::string& name, Eigen::Index rows, Eigen::Index cols) const;

private:
    [[nodiscard]] double number_of(const YAML::Node& node, const std::string& what) const;
    [[nodiscard]] Eigen::MatrixXd matrix_of_rows(const YAML::Node& rows, const std::string& name) const;

    std::string name_;
    YAML::Node root_;
};

}  // namespace raylign::detail
