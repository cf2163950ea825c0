#include <cmath>
#include <fstream>

#include "core/error.h"
#include "core/io/file_format.h"
#include "core/io/json_node.h"
#include "core/io/pose_io.h"
#include "core/io/text.h"

namespace raylign {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points targets_from_json(const std::filesystem::path& path) {
    const nlohmann::json json = detail::read_json(path);
    const detail::JsonNode root(json, "the file", path.string());
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

/// What the header line "# CoordinateSystem = ..." says: 3D Slicer wrote 0 or RAS, 1 or LPS, 2 or IJK. True for RAS.
bool is_ras(std::string_view text, const std::string& where) {
    if (text == "0" || text == "RAS") return true;
    if (text == "1" || text == "LPS") return false;
    throw bad_value("CoordinateSystem", text, "RAS (0) or LPS (1)", where);
}

/// Rows id,x,y,z,... of 3D Slicer, brought to LPS. Without a header line the file is RAS, as old Slicers wrote it.
Points targets_from_fcsv(const std::filesystem::path& path) {
    std::ifstream file(path);
    Points points;
    std::string line;
    bool ras = true;
    for (int number = 1; std::getline(file, line); ++number) {
        const std::string_view text = detail::trimmed(line);
        if (text.empty()) continue;
        if (text.front() == '#') {
            const std::vector<std::string_view> parts = detail::split(text.substr(1), '=');
            if (parts.size() == 2 && detail::trimmed(parts[0]) == "CoordinateSystem") {
                ras = is_ras(detail::trimmed(parts[1]), place(path, number));
            }
            continue;
        }
        const std::vector<std::string_view> fields = detail::split(text, ',');
        if (fields.size() < 4) throw bad_value("row", text, "id,x,y,z,... [mm]", place(path, number));
        const Eigen::Vector3d point = point_from(fields, 1, place(path, number));
        points.push_back(ras ? Eigen::Vector3d(-point.x(), -point.y(), point.z()) : point);
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
        points = targets_from_fcsv(path);
    } else {
        throw bad_value("format of the targets", extension, ".json, .csv or .fcsv", path.string());
    }
    if (points.empty()) throw Error(path.string() + " has no targets: must have at least one point");
    return points;
}

}  // namespace raylign
