#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"

namespace raylign::detail {

/// A matrix as JSON: an array of its rows.
template <typename Matrix>
nlohmann::json rows_of(const Matrix& matrix) {
    nlohmann::json rows = nlohmann::json::array();
    for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
        nlohmann::json row = nlohmann::json::array();
        for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(matrix(r, c));
        rows.push_back(row);
    }
    return rows;
}

/// Reads a JSON file. Throws Error naming the file with the line and column of malformed text, or a key given twice.
[[nodiscard]] nlohmann::json read_json(const std::filesystem::path& path);

/// JSON text for people: two blanks of indent, arrays of numbers on one line, every digit of a number kept.
[[nodiscard]] std::string json_text(const nlohmann::json& value);

/// A JSON value with its place ("views[1].camera.sdd_mm" of a file), which every error names. Borrows the value.
class JsonNode {
public:
    JsonNode(const nlohmann::json& value, std::string place, std::string file)
        : value_(&value), place_(std::move(place)), file_(std::move(file)) {}

    /// Throws unless this is an object with no other keys than these; names the nearest one for a typo.
    void allow_keys(std::initializer_list<std::string_view> keys) const;
    [[nodiscard]] bool has(const std::string& key) const { return value_->is_object() && value_->contains(key); }
    [[nodiscard]] JsonNode at(const std::string& key) const;  ///< throws where missing
    [[nodiscard]] JsonNode at(std::size_t index) const;       ///< of an array, index < array_size()

    [[nodiscard]] std::size_t array_size() const;  ///< throws unless an array
    [[nodiscard]] double number() const;           ///< finite
    [[nodiscard]] double positive() const;
    [[nodiscard]] bool is_text() const { return value_->is_string(); }
    [[nodiscard]] std::string string() const;
    [[nodiscard]] bool boolean() const;
    [[nodiscard]] std::vector<double> numbers() const;  ///< of an array
    template <int Rows, int Columns>
    [[nodiscard]] Eigen::Matrix<double, Rows, Columns> matrix() const;  ///< array of rows
    template <int Size>
    [[nodiscard]] Eigen::Vector<double, Size> vector() const;
    [[nodiscard]] Eigen::Vector2i size_px() const;  ///< [columns, rows], integers of at least 1
    /// The value's position among `words`.
    [[nodiscard]] std::size_t one_of(std::initializer_list<std::string_view> words) const;

    [[nodiscard]] Error error(std::string_view allowed) const;  ///< "<place> = <value> in <file>: must be <allowed>"
    [[nodiscard]] const std::string& place() const { return place_; }
    [[nodiscard]] const std::string& file() const { return file_; }
    [[nodiscard]] std::string where() const;  ///< "<place> of <file>"

private:
    void need_array(std::size_t size, std::string_view allowed) const;

    const nlohmann::json* value_;
    std::string place_, file_;
};

/// Throws unless `root` is an object that says "raylign": 1.
void check_format_version(const JsonNode& root);

template <int Rows, int Columns>
Eigen::Matrix<double, Rows, Columns> JsonNode::matrix() const {
    const std::string allowed = std::to_string(Rows) + " rows of " + std::to_string(Columns) + " numbers";
    need_array(Rows, allowed);
    Eigen::Matrix<double, Rows, Columns> matrix;
    for (int r = 0; r < Rows; ++r) {
        const JsonNode row = at(static_cast<std::size_t>(r));
        row.need_array(Columns, std::to_string(Columns) + " numbers");
        for (int c = 0; c < Columns; ++c) matrix(r, c) = row.at(static_cast<std::size_t>(c)).number();
    }
    return matrix;
}

template <int Size>
Eigen::Vector<double, Size> JsonNode::vector() const {
    need_array(Size, std::to_string(Size) + " numbers");
    Eigen::Vector<double, Size> vector;
    for (int i = 0; i < Size; ++i) vector[i] = at(static_cast<std::size_t>(i)).number();
    return vector;
}

}  // namespace raylign::detail
