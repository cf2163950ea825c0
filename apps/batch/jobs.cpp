#include "apps/batch/jobs.h"

#include <algorithm>
#include <set>

#include "apps/shared/invocation.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/files/csv.h"
#include "core/io/files/text.h"
#include "core/io/views/view_files.h"

namespace raylign::detail::apps {
namespace {

constexpr const char* kFlag = "yes";

void add_option(const std::string& option, const std::string& cell, BatchJob& job) {
    if (cell.empty()) return;
    if (cell == kFlag) {
        job.arguments.push_back("--" + option);
        return;
    }
    for (const std::string_view value : split(cell, ';')) {
        job.arguments.push_back("--" + option);
        job.arguments.emplace_back(value);
    }
}

BatchJob job_of(const CsvRow& heading, const CsvRow& row) {
    if (row.cells.size() != heading.cells.size()) {
        throw bad_value("columns", std::to_string(row.cells.size()),
                        std::to_string(heading.cells.size()) + " as in the heading", row.where);
    }
    BatchJob job{.name = "", .command = "register", .arguments = {}, .where = row.where};
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
        const std::string& option = heading.cells[i];
        const std::string& cell = row.cells[i];
        if (option == "name") {
            job.name = cell;
        } else if (option != "command") {
            add_option(option, cell, job);
        } else if (!cell.empty()) {
            job.command = cell;
        }
    }
    if (!is_view_name(job.name)) {
        throw bad_value("name", job.name, "letters, digits, '_', '-' or '.' (it becomes a folder)", row.where);
    }
    if (job.command != "register" && job.command != "track") {
        throw bad_value("command", job.command, "register or track", row.where);
    }
    return job;
}

}  // namespace

std::string BatchJob::key() const {
    std::vector<std::string> words{command};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return quote_for_shell(words);
}

std::vector<BatchJob> read_jobs(const std::filesystem::path& path) {
    const CsvTable table = read_csv(path);
    if (std::ranges::find(table.heading.cells, "name") == table.heading.cells.end()) {
        throw Error(path.string() + " needs a heading with a column \"name\"; the others are options without \"--\"");
    }
    for (const std::string& option : table.heading.cells) {
        if (option == "o" || option == "output") throw Error(path.string() + ": a job's folder is its name below -o");
    }
    std::vector<BatchJob> jobs;
    std::set<std::string> names;
    for (const CsvRow& row : table.rows) {
        jobs.push_back(job_of(table.heading, row));
        if (!names.insert(lower_case(jobs.back().name)).second) {
            throw bad_value("name", jobs.back().name, "different from the other rows'", row.where);
        }
    }
    if (jobs.empty()) throw Error(path.string() + " has no jobs below its heading");
    return jobs;
}

}  // namespace raylign::detail::apps
