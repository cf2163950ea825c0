#include "core/io/poses/pose_text.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "core/base/error.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

std::vector<std::string> cells_between_blanks(std::string_view text) {
    std::vector<std::string> cells;
    for (const std::string_view word : split(text, ' ')) {
        if (!word.empty()) cells.emplace_back(word);
    }
    return cells;
}

std::vector<std::string> cells_in(std::string text) {
    std::ranges::replace(text, '\t', ' ');
    std::string_view rest = trimmed(text);
    if (rest.find(',') == std::string_view::npos) return cells_between_blanks(rest);
    if (rest.ends_with(',')) rest.remove_suffix(1);
    std::vector<std::string> cells;
    for (const std::string_view part : split(rest, ',')) cells.emplace_back(trimmed(part));
    return cells;
}

}  // namespace

std::vector<PoseLine> pose_lines(const std::filesystem::path& path) {
    constexpr std::uintmax_t kLargest = std::uintmax_t{1} << 29;  // a million frames of 16 numbers with 20 digits
    check_readable_file(path);
    if (std::filesystem::file_size(path) > kLargest) {
        throw bad_value("size of the table of poses", std::to_string(std::filesystem::file_size(path)) + " bytes",
                        "at most 512 MB of text", path.string());
    }
    std::ifstream file(path, std::ios::binary);
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.find('\0') != std::string::npos) throw Error(path.string() + " is no text file");
    std::vector<PoseLine> lines;
    int number = 0;
    for (const std::string_view line : split(text, '\n')) {
        ++number;
        if (!trimmed(line).empty()) lines.push_back({number, cells_in(std::string(trimmed(line)))});
    }
    if (lines.empty()) throw Error(path.string() + " has no text");
    return lines;
}

std::string line_name(const std::filesystem::path& path, const PoseLine& line) {
    return path.string() + ", line " + std::to_string(line.number);
}

std::vector<double> cell_numbers(const PoseLine& line, const std::filesystem::path& path) {
    std::vector<double> numbers;
    for (const std::string& cell : line.cells) {
        const std::optional<double> number = number_from(cell);
        if (!number || std::isinf(*number)) {
            throw bad_value("number", "\"" + cell.substr(0, 40) + "\"", "a number, or NaN where there is no pose",
                            line_name(path, line));
        }
        numbers.push_back(*number);
    }
    return numbers;
}

bool has_nan(std::span<const double> numbers) {
    return std::ranges::any_of(numbers, [](double number) { return std::isnan(number); });
}

}  // namespace raylign::detail
