#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace raylign::detail {

/// A row of a table of text.
struct CsvRow {
    int line = 0;  ///< its number in the file, from 1
    std::vector<std::string> cells;
    std::string where;  ///< "FILE, line N"
};

/// The cells of a line, blanks around them left out. A cell in double quotes may hold the separator, and "" for a
/// quote.
[[nodiscard]] std::vector<std::string> csv_cells(std::string_view line, char separator);

/// Names of columns: no cell is a number, nor begins like one, so that a slip in the first row of numbers ("1O") does
/// not make a heading of it.
[[nodiscard]] bool is_heading(const std::vector<std::string>& cells);

/// A table: a heading where its first row is one (see is_heading), else an empty row, and the others.
struct CsvTable {
    CsvRow heading;
    std::vector<CsvRow> rows;
};

/// Reads a table. The first row tells what is between cells: commas, else semicolons, else tabs, else blanks.
/// Blank lines and lines that begin with # are left out. Throws Error for a file that is no text.
[[nodiscard]] CsvTable read_csv(const std::filesystem::path& path);

/// Its rows, whether it has a heading or not.
[[nodiscard]] inline std::vector<CsvRow> csv_rows(const std::filesystem::path& path) { return read_csv(path).rows; }

/// A cell as a finite number. Throws Error naming `what`, the cell and `where`.
[[nodiscard]] double csv_number(const std::string& cell, std::string_view what, std::string_view allowed,
                                const std::string& where);

}  // namespace raylign::detail
