#include "core/io/poses/markups.h"

#include <cmath>
#include <fstream>

#include "core/base/error.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kLabelColumn = 11;  // id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID

std::string place(const std::filesystem::path& path, int line_number) {
    return path.string() + ", line " + std::to_string(line_number);
}

/// What a file says of its axes: 3D Slicer wrote 0 or RAS, 1 or LPS, 2 or IJK. True for RAS.
bool is_ras(std::string_view text, const std::string& where) {
    if (text == "0" || text == "RAS") return true;
    if (text == "1" || text == "LPS") return false;
    throw bad_value("CoordinateSystem", text, "RAS (0) or LPS (1)", where);
}

Eigen::Vector3d in_lps(const Eigen::Vector3d& point, bool ras) {
    return ras ? Eigen::Vector3d(-point.x(), -point.y(), point.z()) : point;
}

Eigen::Vector3d point_from(const std::vector<std::string_view>& fields, const std::string& where) {
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value = number_from(fields[axis + 1]);
        if (!value || !std::isfinite(*value)) {
            throw bad_value(std::string(1, "xyz"[axis]), fields[axis + 1], "a finite number [mm]", where);
        }
        point[static_cast<Eigen::Index>(axis)] = *value;
    }
    return point;
}

void append_markup(const JsonNode& markup, std::vector<Landmark>& landmarks) {
    const bool ras = markup.has("coordinateSystem") && is_ras(markup.at("coordinateSystem").string(), markup.where());
    if (markup.has("coordinateUnits")) {
        const JsonNode units = markup.at("coordinateUnits");  // later Slicers write a list of codes
        if (units.is_text() && units.string() != "mm") throw units.error("mm");
    }
    const JsonNode points = markup.at("controlPoints");
    for (std::size_t i = 0; i < points.array_size(); ++i) {
        const JsonNode point = points.at(i);
        if (point.has("positionStatus") && point.at("positionStatus").string() != "defined") continue;
        landmarks.push_back({point.has("label") ? point.at("label").string() : std::string(),
                             in_lps(point.at("position").vector<3>(), ras)});
    }
}

}  // namespace

std::vector<Landmark> read_fcsv(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::vector<Landmark> landmarks;
    std::string line;
    bool ras = true;
    for (int number = 1; std::getline(file, line); ++number) {
        const std::string_view text = trimmed(line);
        if (text.empty()) continue;
        if (text.front() == '#') {
            const std::vector<std::string_view> parts = split(text.substr(1), '=');
            if (parts.size() == 2 && trimmed(parts[0]) == "CoordinateSystem") {
                ras = is_ras(trimmed(parts[1]), place(path, number));
            }
            continue;
        }
        const std::vector<std::string_view> fields = split(text, ',');
        if (fields.size() < 4) throw bad_value("row", text, "id,x,y,z,... [mm]", place(path, number));
        const bool has_label = fields.size() > kLabelColumn;
        landmarks.push_back({std::string(has_label ? trimmed(fields[kLabelColumn]) : std::string_view()),
                             in_lps(point_from(fields, place(path, number)), ras)});
    }
    return landmarks;
}

std::vector<Landmark> read_markups(const std::filesystem::path& path) {
    const nlohmann::json json = read_json(path);
    const JsonNode root(json, "the file", path.string());
    const JsonNode markups = root.at("markups");  // other keys are Slicer's own
    std::vector<Landmark> landmarks;
    for (std::size_t i = 0; i < markups.array_size(); ++i) append_markup(markups.at(i), landmarks);
    return landmarks;
}

}  // namespace raylign::detail
