#include "core/io/poses/markups.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/io/files/csv.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"

namespace raylign::detail {
namespace {

/// Where a .fcsv has what; a line "# columns = ..." overrules it (Slicer 3: label,x,y,z,sel,vis).
struct FcsvColumns {
    std::size_t x = 1, label = 11;  // id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
};

FcsvColumns columns_of(std::string_view names, const std::string& where) {
    const std::vector<std::string> cells = csv_cells(names, ',');
    const auto place_of = [&](const char* name) {
        return static_cast<std::size_t>(std::ranges::find(cells, name) - cells.begin());
    };
    const FcsvColumns columns{place_of("x"), place_of("label")};
    if (columns.x == cells.size() || place_of("y") != columns.x + 1 || place_of("z") != columns.x + 2) {
        throw bad_value("columns", names, "names with x,y,z in this order", where);
    }
    return columns;
}

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

Eigen::Vector3d point_from(const std::vector<std::string>& cells, std::size_t first, const std::string& where) {
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        point[static_cast<Eigen::Index>(axis)] =
            csv_number(cells[first + axis], std::string(1, "xyz"[axis]), "a finite number [mm]", where);
    }
    return point;
}

/// Text in Slicer 5, a number in the first files of this kind. LPS where the file does not say.
bool is_markup_ras(const JsonNode& markup) {
    if (!markup.has("coordinateSystem")) return false;
    const JsonNode system = markup.at("coordinateSystem");
    return is_ras(system.is_text() ? system.string() : number_text(system.number()), markup.where());
}

/// "mm", or as later Slicers write it ["mm", "UCUM", "millimeter"].
void check_units(const JsonNode& markup) {
    if (!markup.has("coordinateUnits")) return;
    const JsonNode units = markup.at("coordinateUnits");
    const JsonNode unit = units.is_text() || units.array_size() == 0 ? units : units.at(0);
    if (!unit.is_text() || unit.string() != "mm") throw units.error("mm");
}

void append_markup(const JsonNode& markup, std::vector<Landmark>& landmarks) {
    const bool ras = is_markup_ras(markup);
    check_units(markup);
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
    std::vector<Landmark> landmarks;
    FcsvColumns columns;
    bool ras = true;
    int number = 0;
    const std::string all = read_text_file(path);
    for (const std::string_view line : split(all, '\n')) {
        const std::string_view text = trimmed(line);
        const std::string where = place(path, ++number);
        if (text.empty()) continue;
        if (text.front() == '#') {
            const std::vector<std::string_view> parts = split(text.substr(1), '=');
            const std::string_view key = trimmed(parts[0]);
            if (parts.size() == 2 && key == "CoordinateSystem") ras = is_ras(trimmed(parts[1]), where);
            if (parts.size() == 2 && key == "columns") columns = columns_of(trimmed(parts[1]), where);
            continue;
        }
        const std::vector<std::string> cells = csv_cells(text, ',');
        if (cells.size() < columns.x + 3) throw bad_value("row", text, "id,x,y,z,... [mm]", where);
        landmarks.push_back({columns.label < cells.size() ? cells[columns.label] : std::string(),
                             in_lps(point_from(cells, columns.x, where), ras)});
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
