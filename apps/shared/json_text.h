#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "raylign/rigid_transform.h"

namespace raylign::detail::apps {

/// Keys stay in the order in which they were added.
using Json = nlohmann::ordered_json;

/// Names of files and views may hold bytes that are not UTF-8: both replace them rather than be fatal to the run.
/// Control characters are escaped, DEL and U+0080 to U+009F with them, which JSON need not: terminals obey them.
[[nodiscard]] std::string one_line(const Json& json);
/// With a final line feed.
[[nodiscard]] std::string indented(const Json& json, int indent = 2);

/// A line of a file. Throws Error where it is no JSON, or nested too deep for what reads or prints it.
[[nodiscard]] Json json_of_line(const std::string& line);

template <class Derived>
[[nodiscard]] Json vector_json(const Eigen::MatrixBase<Derived>& vector) {
    Json list = Json::array();
    for (Eigen::Index i = 0; i < vector.size(); ++i) list.push_back(vector(i));
    return list;
}

/// A list of rows.
template <class Derived>
[[nodiscard]] Json matrix_json(const Eigen::MatrixBase<Derived>& matrix) {
    Json rows = Json::array();
    for (Eigen::Index r = 0; r < matrix.rows(); ++r) rows.push_back(vector_json(matrix.row(r)));
    return rows;
}

/// 4 x 4.
[[nodiscard]] inline Json matrix_json(const RigidTransform& b_from_a) { return matrix_json(to_matrix(b_from_a)); }

[[nodiscard]] inline Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

}  // namespace raylign::detail::apps
