#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace raylign::detail::apps {

/// A row of jobs.csv.
struct BatchJob {
    std::string name;                    ///< of its folder
    std::string command;                 ///< register or track
    std::vector<std::string> arguments;  ///< after the command, without -o
    std::string where;                   ///< "FILE, line N"

    /// What it is told from other jobs by: the command line without -o.
    [[nodiscard]] std::string key() const;
};

/// Reads a table with a heading: `name` (letters, digits, '_', '-', '.'; all different), `command` (register or track;
/// register where there is no such column or the cell is empty), and options of the command by their long names without
/// "--". An empty cell leaves the option out; "yes" is a flag; values of an option that may be repeated stand between
/// semicolons. Throws Error, with the line, for what is not so; whether files exist is for each job to find out.
[[nodiscard]] std::vector<BatchJob> read_jobs(const std::filesystem::path& path);

}  // namespace raylign::detail::apps
