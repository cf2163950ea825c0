#pragma once

#include <sys/utsname.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace raylign::detail::bench {

#ifdef __clang__
inline constexpr const char* kCompiler = __VERSION__;
#else
inline constexpr const char* kCompiler = "g++ " __VERSION__;
#endif

[[nodiscard]] inline std::string quoted(const std::string& text) {
    std::string json = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') json += '\\';
        json += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
    }
    return json + '"';
}

/// Four digits, or all that stand before the point.
[[nodiscard]] inline std::string number_json(double value) {
    if (!std::isfinite(value)) return quoted(std::to_string(value));
    char text[32];
    std::snprintf(text, sizeof text, std::abs(value) < 1000 ? "%.4g" : "%.0f", value);
    return text;
}

/// Processor, threads that this process may run at once, and system.
[[nodiscard]] inline std::string machine() {
    std::string processor = "unknown processor";
    std::ifstream lines("/proc/cpuinfo");
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("model name")) continue;
        processor = line.substr(line.find(':') + 2);
        break;
    }
    utsname names{};
    (void)uname(&names);
    return processor + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads, " + names.sysname + " " +
           names.release;
}

/// A number or a text of a row.
struct Cell {
    std::string json;
    template <class Value>
    Cell(const Value& value) {  // NOLINT(google-explicit-constructor): rows are lists of values
        if constexpr (std::is_arithmetic_v<Value>) {
            json = number_json(static_cast<double>(value));
        } else {
            json = quoted(value);
        }
    }
};

/// What a program measured, in the form that bench/make_tables.py puts into a page.
class Record {
public:
    /// Takes `--json FILE` out of the arguments; without it write() does nothing. Throws Error where FILE is missing.
    /// Columns: headings, with the unit of their numbers in brackets: "time, median [s]".
    Record(int& argc, char** argv, std::string title, std::vector<std::string> columns)
        : title_(std::move(title)), command_(argv[0]), columns_(std::move(columns)) {
        command_.erase(0, command_.find_last_of('/') + 1);
        int kept = 1;
        for (int i = 1; i < argc; ++i) {
            if (std::string(argv[i]) == "--json") {
                if (++i == argc) throw Error("--json needs a file");
                file_ = argv[i];
                continue;
            }
            command_ += std::string(" ") + argv[i];
            argv[kept++] = argv[i];
        }
        argc = kept;
        // Found out before the work rather than after it.
        if (!file_.empty() && !std::ofstream(file_, std::ios::app)) throw Error("cannot write " + file_);
    }

    void note(const std::string& text) { notes_ += (notes_.empty() ? "" : "; ") + text; }

    /// As many cells as there are columns.
    void add(std::vector<Cell> row) { rows_.push_back(std::move(row)); }

    /// Throws Error where the file cannot be written.
    void write() const {
        if (file_.empty()) return;
        char date[16];
        const std::time_t now = std::time(nullptr);
        std::strftime(date, sizeof date, "%Y-%m-%d", std::gmtime(&now));
        std::ofstream out(file_);
        out << "{\n  \"title\": " << quoted(title_) << ",\n  \"date\": \"" << date
            << "\",\n  \"machine\": " << quoted(machine()) << ",\n  \"compiler\": " << quoted(kCompiler)
            << ",\n  \"command\": " << quoted(command_) << ",\n  \"notes\": " << quoted(notes_)
            << ",\n  \"columns\": [";
        for (const std::string& column : columns_) {
            const std::size_t unit = column.find('[');
            out << (&column == columns_.data() ? "\n" : ",\n") << "    {\"name\": " << quoted(column) << ", \"unit\": "
                << quoted(unit == column.npos ? "" : column.substr(unit + 1, column.find(']') - unit - 1)) << "}";
        }
        out << "\n  ],\n  \"rows\": [";
        for (const std::vector<Cell>& row : rows_) {
            out << (&row == rows_.data() ? "\n    [" : ",\n    [");
            for (const Cell& cell : row) out << (&cell == row.data() ? "" : ", ") << cell.json;
            out << "]";
        }
        out << "\n  ]\n}\n" << std::flush;
        if (!out) throw Error("cannot write " + file_);
    }

private:
    std::string title_, command_, file_, notes_;
    std::vector<std::string> columns_;
    std::vector<std::vector<Cell>> rows_;
};

}  // namespace raylign::detail::bench
