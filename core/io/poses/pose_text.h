#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace raylign::detail {

/// A line of a table of poses: its number in the file, from 1, and its cells without blanks around them.
struct PoseLine {
    int number = 0;
    std::vector<std::string> cells;
};

/// The lines of a text file that are not blank. Cells stand between commas; in a line without any, between blanks. A
/// comma at the end of a line ends its last cell. Throws Error for a file that is missing, has bytes that are no text,
/// or is larger than a table of a million frames.
[[nodiscard]] std::vector<PoseLine> pose_lines(const std::filesystem::path& path);

/// "FILE, line N"
[[nodiscard]] std::string line_name(const std::filesystem::path& path, const PoseLine& line);

/// All cells as numbers; NaN stays NaN. Throws Error for a cell that is none.
[[nodiscard]] std::vector<double> cell_numbers(const PoseLine& line, const std::filesystem::path& path);

/// Whether one of them is NaN: the tables' way to say that there is no pose.
[[nodiscard]] bool has_nan(std::span<const double> numbers);

}  // namespace raylign::detail
