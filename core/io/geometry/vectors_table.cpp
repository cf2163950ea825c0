#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/io/files/csv.h"
#include "core/io/files/text.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

constexpr std::size_t kVectorNumbers = 12;
constexpr std::size_t kMostViews = 100000;

/// A row: source, a point of the detector, and the steps from a pixel to the next, all in world [mm].
struct VectorRow {
    std::string name, where;
    Eigen::Vector3d source, detector, right, down;
    bool is_origin = false;  ///< `detector` is the centre of pixel (0, 0), else the image's middle
    std::optional<Eigen::Vector2i> size_px;
};

/// Which cell is what. Without a heading: ASTRA's cone_vec.
struct VectorColumns {
    std::array<std::size_t, kVectorNumbers> numbers = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
    bool is_origin = false;
    std::optional<std::size_t> name, columns, rows;
    std::size_t count = kVectorNumbers;
};

/// "Source X [mm]" and "source_x_mm" are "sourcex".
std::string plain_word(std::string_view cell) {
    std::string word;
    for (const char c : lower_case(cell)) {
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) word += c;
    }
    if (word.ends_with("mm")) word.erase(word.size() - 2);
    return word;
}

/// 0 to 11, the place among the numbers of a row; none for a name that is no vector's.
std::optional<std::size_t> number_named(const std::string& word, bool& is_origin) {
    constexpr std::array<std::pair<std::string_view, std::size_t>, 9> kVectors = {{{"source", 0},
                                                                                   {"src", 0},
                                                                                   {"detectorcentre", 3},
                                                                                   {"detectorcenter", 3},
                                                                                   {"detectororigin", 3},
                                                                                   {"right", 6},
                                                                                   {"u", 6},
                                                                                   {"down", 9},
                                                                                   {"v", 9}}};
    for (const auto& [vector, first] : kVectors) {
        if (!word.starts_with(vector) || word.size() != vector.size() + 1) continue;
        const char axis = word.back();
        if (axis < 'x' || axis > 'z') continue;
        is_origin = is_origin || vector == "detectororigin";
        return first + static_cast<std::size_t>(axis - 'x');
    }
    return std::nullopt;
}

VectorColumns columns_named(const CsvRow& heading) {
    VectorColumns columns;
    columns.count = heading.cells.size();
    columns.numbers.fill(columns.count);
    for (std::size_t i = 0; i < columns.count; ++i) {
        const std::string word = plain_word(heading.cells[i]);
        const auto number = number_named(word, columns.is_origin);
        if (number && columns.numbers[*number] != columns.count) {
            throw bad_value("column", heading.cells[i], "given once", heading.where);
        }
        if (number) {
            columns.numbers[*number] = i;
        } else if (word == "name") {
            columns.name = i;
        } else if (word == "columns" || word == "width") {
            columns.columns = i;
        } else if (word == "rows" || word == "height") {
            columns.rows = i;
        } else {
            throw bad_value("column", heading.cells[i],
                            "name, source_x, _y, _z, detector_centre_x, .. or detector_origin_x, .., right_x, .., "
                            "down_x, .., columns or rows",
                            heading.where);
        }
    }
    if (std::ranges::find(columns.numbers, columns.count) != columns.numbers.end() ||
        columns.columns.has_value() != columns.rows.has_value()) {
        throw Error("the heading in " + heading.where +
                    ": must name x, y and z of source, detector_centre (or detector_origin), right and down, and both "
                    "or none of columns and rows");
    }
    return columns;
}

int whole_cell(const std::string& cell, const std::string& what, const std::string& where) {
    const double number = csv_number(cell, what, "a whole number", where);
    if (number != std::round(number) || !(std::abs(number) < 1e6)) throw bad_value(what, cell, "a whole number", where);
    return static_cast<int>(number);
}

VectorRow row_from(const CsvRow& row, const VectorColumns& columns) {
    if (row.cells.size() != columns.count) {
        throw bad_value("cells", std::to_string(row.cells.size()), std::to_string(columns.count), row.where);
    }
    std::array<Eigen::Vector3d, 4> vectors;
    for (std::size_t i = 0; i < kVectorNumbers; ++i) {
        vectors[i / 3][static_cast<Eigen::Index>(i % 3)] =
            csv_number(row.cells[columns.numbers[i]], "number", "finite [mm]", row.where);
    }
    VectorRow result{"", row.where, vectors[0], vectors[1], vectors[2], vectors[3], columns.is_origin, std::nullopt};
    if (columns.name) result.name = row.cells[*columns.name];
    if (columns.columns) {
        result.size_px = Eigen::Vector2i(whole_cell(row.cells[*columns.columns], "columns", row.where),
                                         whole_cell(row.cells[*columns.rows], "rows", row.where));
    }
    return result;
}

/// A detector point is source + l A (column, row, 1), A = (right, down, pixel (0, 0) - source): pixel = A^-1 (x -
/// source), whose third number is 1 on the detector.
GeometryView view_of_vectors(const VectorRow& row, const GeometryHints& hints, const std::string& name) {
    StoredProjection stored;
    stored.size_px = settled_size(row.size_px, hints, row.where);
    const Eigen::Vector2d middle = (stored.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
    const Eigen::Vector3d origin =
        row.is_origin ? row.detector : row.detector - middle.x() * row.right - middle.y() * row.down;
    Eigen::Matrix3d world_from_pixel;
    world_from_pixel << row.right, row.down, origin - row.source;
    const Eigen::Vector3d normal = row.right.cross(row.down);
    const double sdd_mm = std::abs(normal.dot(origin - row.source)) / normal.norm();
    const double volume = std::abs(determinant_of(world_from_pixel));
    if (!(normal.norm() > 1e-9 * row.right.norm() * row.down.norm()) || !(sdd_mm > 0) || !(volume > 0)) {
        throw Error(row.where + ": right and down must be two directions, and the source must not lie on the detector");
    }
    const Eigen::Matrix3d pixel_from_ray = inverse_of(world_from_pixel);
    stored.pixel_from_world << pixel_from_ray, -pixel_from_ray * row.source;
    stored.sdd_mm = sdd_mm;
    stored.assumptions = {std::string("vectors: source, ") +
                          (row.is_origin ? "centre of pixel (0, 0)" : "image's middle") +
                          ", steps to the next column and the next row, in mm of one world"};
    return finish_view(std::move(stored), hints, name, row.where);
}

}  // namespace

bool is_vectors_table(const std::filesystem::path& path) {
    const CsvTable table = read_csv(path);
    if (!table.heading.cells.empty()) {
        const auto names_source = [](const std::string& cell) { return plain_word(cell).starts_with("source"); };
        return std::ranges::any_of(table.heading.cells, names_source);
    }
    if (table.rows.empty() || table.rows.front().cells.size() != kVectorNumbers) return false;
    return std::ranges::all_of(table.rows.front().cells,
                               [](const auto& cell) { return number_from(cell).has_value(); });
}

std::vector<GeometryView> read_vectors(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    for (const auto& [is_given, what] : {std::pair{hints.pixel_pitch_mm.has_value(), "pixel_pitch_mm"},
                                         {hints.detector_origin_mm.has_value(), "detector_origin_mm"},
                                         {hints.sad_mm || hints.sdd_mm, "sad_mm or sdd_mm"},
                                         {hints.unit_mm.has_value(), "unit_mm"},
                                         {hints.undistorted.has_value(), "undistorted"},
                                         {hints.primary_angle_deg || hints.secondary_angle_deg, "an angle"}}) {
        refuse_hint(is_given, what, "a table of vectors", where);
    }
    const CsvTable table = read_csv(path);
    const VectorColumns columns = table.heading.cells.empty() ? VectorColumns() : columns_named(table.heading);
    const std::size_t count = table.rows.size();
    if (count == 0 || count > kMostViews) {
        throw bad_value("rows", std::to_string(count), "in [1, " + std::to_string(kMostViews) + "]", where);
    }
    if (hints.item < 0 || static_cast<std::size_t>(hints.item) > count) {
        throw bad_value("projection", std::to_string(hints.item), "in [1, " + std::to_string(count) + "]", where);
    }
    std::vector<GeometryView> views;
    for (std::size_t i = 1; i <= count; ++i) {
        if (hints.item != 0 && static_cast<std::size_t>(hints.item) != i) continue;
        const VectorRow row = row_from(table.rows[i - 1], columns);
        const std::string numbered = path.stem().string() + (count > 1 ? "_" + std::to_string(i) : "");
        views.push_back(view_of_vectors(row, hints, row.name.empty() ? numbered : row.name));
    }
    return views;
}

}  // namespace detail

std::string vectors_text(std::span<const ViewGeometry> views, std::span<const std::string> names) {
    std::string text =
        "name,source_x_mm,source_y_mm,source_z_mm,detector_centre_x_mm,detector_centre_y_mm,detector_centre_z_mm,"
        "right_x_mm,right_y_mm,right_z_mm,down_x_mm,down_y_mm,down_z_mm,columns,rows\n";
    for (std::size_t i = 0; i < views.size(); ++i) {
        const Camera& camera = views[i].camera;
        if (!camera.sdd_mm) throw Error("a table of vectors needs the detector's distance: give sdd_mm");
        // Steps on the detector per pixel, in world; the third column is the way from the source to pixel (0, 0).
        const Eigen::Matrix3d world_from_pixel =
            *camera.sdd_mm * views[i].camera_from_world.rotation.transpose() * detail::inverse_of(camera.intrinsics_px);
        const Eigen::Vector2d middle = (camera.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
        const Eigen::Vector3d source = source_world_mm(views[i]);
        const Eigen::Vector3d centre = source + world_from_pixel * Eigen::Vector3d(middle.x(), middle.y(), 1);
        text += i < names.size() ? names[i] : "view_" + std::to_string(i + 1);
        for (const Eigen::Vector3d& vector :
             {source, centre, Eigen::Vector3d(world_from_pixel.col(0)), Eigen::Vector3d(world_from_pixel.col(1))}) {
            for (const double number : vector) text += "," + detail::number_text(number + 0.0);  // no -0
        }
        text += "," + std::to_string(camera.size_px.x()) + "," + std::to_string(camera.size_px.y()) + "\n";
    }
    return text;
}

}  // namespace raylign
