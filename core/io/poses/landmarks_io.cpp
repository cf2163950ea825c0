#include "raylign/io/landmarks.h"

#include <set>

#include "core/base/error.h"
#include "core/io/files/csv.h"
#include "core/io/files/file_format.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"
#include "core/io/poses/markups.h"

namespace raylign {
using namespace detail;
namespace {

using detail::JsonNode;

/// A row of `count` numbers, with or without a name before them.
template <int Count>
std::pair<std::string, Eigen::Vector<double, Count>> named_numbers(const CsvRow& row) {
    const bool has_name = row.cells.size() == Count + 1;
    if (!has_name && row.cells.size() != Count) {
        throw bad_value("row", detail::joined(std::vector<std::string_view>(row.cells.begin(), row.cells.end()), ","),
                        Count == 3 ? "name,x,y,z or x,y,z [mm]" : "name,x,y or x,y [px]", row.where);
    }
    Eigen::Vector<double, Count> numbers;
    for (int i = 0; i < Count; ++i) {
        const std::string& cell = row.cells[static_cast<std::size_t>(i) + (has_name ? 1 : 0)];
        numbers[i] = csv_number(cell, "coordinate", "a finite number", row.where);
    }
    return {has_name ? row.cells[0] : std::string(), numbers};
}

template <typename Points>
void check_points(const Points& points, const std::filesystem::path& path) {
    if (points.empty()) throw Error(path.string() + " has no points: must have at least one");
    std::set<std::string> names;
    std::size_t unnamed = 0;
    for (const auto& point : points) {
        unnamed += point.name.empty();
        if (!point.name.empty() && !names.insert(point.name).second) {
            throw Error("the name \"" + point.name + "\" is given twice in " + path.string());
        }
    }
    if (unnamed != 0 && unnamed != points.size()) {
        throw Error(path.string() + ": some points have names and some have none: must be all or none");
    }
}

std::vector<ImagePoint> image_points_from_json(const std::filesystem::path& path) {
    const nlohmann::json json = detail::read_json(path);
    const JsonNode root(json, "the file", path.string());
    root.allow_keys({"raylign", "points_px"});
    if (root.has("raylign")) detail::check_format_version(root);
    const JsonNode list = root.at("points_px");
    std::vector<ImagePoint> points;
    if (json.at("points_px").is_object()) {
        for (const auto& [name, unused] : json.at("points_px").items())
            points.push_back({name, list.at(name).vector<2>()});
        return points;
    }
    for (std::size_t i = 0; i < list.array_size(); ++i) points.push_back({"", list.at(i).vector<2>()});
    return points;
}

}  // namespace

std::vector<Landmark> read_landmarks(const std::filesystem::path& path) {
    detail::check_readable_file(path);
    const std::string extension = detail::lower_case(path.extension().string());
    std::vector<Landmark> landmarks;
    if (extension == ".json") {
        landmarks = detail::read_markups(path);
    } else if (extension == ".fcsv") {
        landmarks = detail::read_fcsv(path);
    } else if (extension == ".csv" || extension == ".txt") {
        for (const CsvRow& row : csv_rows(path)) {
            const auto [name, x_ct_mm] = named_numbers<3>(row);
            landmarks.push_back({name, x_ct_mm});
        }
    } else {
        throw bad_value("format of the landmarks", extension, ".json (Markups), .fcsv or .csv", path.string());
    }
    check_points(landmarks, path);
    return landmarks;
}

std::vector<ImagePoint> read_image_points(const std::filesystem::path& path) {
    detail::check_readable_file(path);
    const std::string extension = detail::lower_case(path.extension().string());
    std::vector<ImagePoint> points;
    if (extension == ".json") {
        points = image_points_from_json(path);
    } else if (extension == ".csv" || extension == ".txt") {
        for (const CsvRow& row : csv_rows(path)) {
            const auto [name, pixel] = named_numbers<2>(row);
            points.push_back({name, pixel});
        }
    } else {
        throw bad_value("format of the image points", extension, ".csv or .json", path.string());
    }
    check_points(points, path);
    return points;
}

}  // namespace raylign
