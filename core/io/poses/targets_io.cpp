#include <cmath>
#include <fstream>

#include "core/base/error.h"
#include "core/io/files/file_format.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"
#include "core/io/poses/markups.h"
#include "raylign/io/pose.h"

namespace raylign {
using namespace detail;
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points points_of(const std::vector<Landmark>& landmarks) {
    Points points;
    for (const Landmark& landmark : landmarks) points.push_back(landmark.x_ct_mm);
    return points;
}

Points targets_from_json(const std::filesystem::path& path) {
    const nlohmann::json json = detail::read_json(path);
    const detail::JsonNode root(json, "the file", path.string());
    if (root.has("markups")) return points_of(detail::read_markups(path));
    root.allow_keys({"raylign", "targets_ct_mm"});
    if (root.has("raylign")) detail::check_format_version(root);
    const detail::JsonNode list = root.at("targets_ct_mm");
    Points points(list.array_size());
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = list.at(i).vector<3>();
    return points;
}

std::string place(const std::filesystem::path& path, int line_number) {
    return path.string() + ", line " + std::to_string(line_number);
}

Eigen::Vector3d point_from(const std::vector<std::string_view>& fields, std::size_t first, const std::string& where) {
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value = detail::number_from(fields[first + axis]);
        if (!value || !std::isfinite(*value)) {
            throw bad_value(std::string(1, "xyz"[axis]), fields[first + axis], "a finite number [mm]", where);
        }
        point[static_cast<Eigen::Index>(axis)] = *value;
    }
    return point;
}

/// Rows x,y,z; lines that begin with # and a first line of words are skipped.
Points targets_from_csv(const std::filesystem::path& path) {
    std::ifstream file(path);
    Points points;
    std::string line;
    bool may_be_heading = true;
    for (int number = 1; std::getline(file, line); ++number) {
        const std::string_view text = detail::trimmed(line);
        if (text.empty() || text.front() == '#') continue;
        const std::vector<std::string_view> fields = detail::split(text, ',');
        const bool is_heading = may_be_heading && !detail::number_from(fields.front());
        may_be_heading = false;
        if (is_heading) continue;
        if (fields.size() != 3) throw bad_value("row", text, "three numbers x,y,z [mm]", place(path, number));
        points.push_back(point_from(fields, 0, place(path, number)));
    }
    return points;
}

}  // namespace

std::vector<Eigen::Vector3d> read_targets(const std::filesystem::path& path) {
    detail::check_readable_file(path);
    const std::string extension = detail::lower_case(path.extension().string());
    Points points;
    if (extension == ".json") {
        points = targets_from_json(path);
    } else if (extension == ".csv") {
        points = targets_from_csv(path);
    } else if (extension == ".fcsv") {
        points = points_of(detail::read_fcsv(path));
    } else {
        throw bad_value("format of the targets", extension, ".json, .csv or .fcsv", path.string());
    }
    if (points.empty()) throw Error(path.string() + " has no targets: must have at least one point");
    return points;
}

}  // namespace raylign
