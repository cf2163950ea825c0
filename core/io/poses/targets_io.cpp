#include "core/base/error.h"
#include "core/io/files/csv.h"
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

Points targets_from_csv(const std::filesystem::path& path) {
    Points points;
    for (const CsvRow& row : csv_rows(path)) {
        if (row.cells.size() != 3) {
            throw bad_value("row", joined(std::vector<std::string_view>(row.cells.begin(), row.cells.end()), ","),
                            "three numbers x,y,z [mm]", row.where);
        }
        Eigen::Vector3d point;
        for (int axis = 0; axis < 3; ++axis) {
            point[axis] = csv_number(row.cells[static_cast<std::size_t>(axis)], std::string(1, "xyz"[axis]),
                                     "a finite number [mm]", row.where);
        }
        points.push_back(point);
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
