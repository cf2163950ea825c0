#include "core/io/files/csv.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"

namespace raylign::detail {
namespace {

bool is_ascii_digit(char c) { return c >= '0' && c <= '9'; }

bool begins_like_a_number(std::string_view cell) {
    if (number_from(cell)) return true;
    if (cell.starts_with('+') || cell.starts_with('-')) cell.remove_prefix(1);
    if (cell.starts_with('.')) cell.remove_prefix(1);
    return !cell.empty() && is_ascii_digit(cell.front());
}

char separator_of(std::string_view line) {
    for (const char separator : {',', ';', '\t'}) {
        if (line.find(separator) != std::string_view::npos) return separator;
    }
    return ' ';
}

}  // namespace

std::vector<std::string> csv_cells(std::string_view line, char separator) {
    std::vector<std::string> cells(1);
    bool is_quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (is_quoted && line[i] == '"' && i + 1 < line.size() && line[i + 1] == '"') {
            cells.back() += line[i++];
        } else if (line[i] == '"') {
            is_quoted = !is_quoted;
        } else if (line[i] == separator && !is_quoted) {
            cells.emplace_back();
        } else {
            cells.back() += line[i];
        }
    }
    for (std::string& cell : cells) cell = std::string(trimmed(cell));
    if (separator == ' ') std::erase(cells, "");
    return cells;
}

bool is_heading(const std::vector<std::string>& cells) { return std::ranges::none_of(cells, begins_like_a_number); }

CsvTable read_csv(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    CsvTable table;
    std::optional<char> separator;
    int number = 0;
    for (const std::string_view whole : split(text, '\n')) {
        ++number;
        const std::string_view line = trimmed(whole);
        if (line.empty() || line.front() == '#') continue;
        const bool is_first = !separator;
        if (is_first) separator = separator_of(line);
        CsvRow row{number, csv_cells(line, *separator), path.string() + ", line " + std::to_string(number)};
        if (is_first && is_heading(row.cells)) {
            table.heading = std::move(row);
        } else {
            table.rows.push_back(std::move(row));
        }
    }
    return table;
}

double csv_number(const std::string& cell, std::string_view what, std::string_view allowed, const std::string& where) {
    const std::optional<double> number = number_from(cell);
    if (!number || !std::isfinite(*number)) throw bad_value(what, cell.empty() ? "\"\"" : cell, allowed, where);
    return *number;
}

}  // namespace raylign::detail
