#include "apps/generate/option_tables.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>

namespace raylign::detail::apps {
namespace {

std::string without(const std::string& text, const std::string& pattern, const std::string& by = "") {
    return std::regex_replace(text, std::regex(pattern), by);
}

/// What the help says where the value stands.
std::string value_word(const CLI::Option& option) {
    if (option.get_items_expected_max() == 0) return "";
    const std::string word = without(option.get_option_text(), " ?\\(required\\)$");
    return word.empty() ? option.get_single_name() : word;
}

ValueKind kind_of(const OptionRow& row) {
    if (row.value.empty()) return ValueKind::none;
    if (row.value.find("FILE") != std::string::npos) return ValueKind::file;
    if (row.value.find("DIR") != std::string::npos) return ValueKind::folder;
    return row.choices.empty() ? ValueKind::other : ValueKind::choice;
}

OptionRow row_of(const CLI::Option& option) {
    OptionRow row;
    for (const std::string& name : option.get_snames()) row.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) row.names.push_back("--" + name);
    row.value = value_word(option);
    row.description = without(option.get_description(), "\n", " ");
    row.is_required = option.get_required();
    row.takes_several = option.get_items_expected_max() > 1;
    const bool is_word = std::regex_match(row.value, std::regex("NAME|BOOL|PRESET|MODEL|[a-z]+"));
    if (is_word) row.choices = listed_choices(row.description);
    row.kind = kind_of(row);
    return row;
}

CommandTable table_of(const CLI::App& app) {
    CommandTable table{.name = app.get_name(), .description = app.get_description(), .footer = app.get_footer()};
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_group().empty()) continue;
        if (!option->nonpositional()) {
            table.positionals.push_back(row_of(*option));
            continue;
        }
        const auto same = [option](const OptionGroup& group) { return group.name == option->get_group(); };
        auto group = std::find_if(table.groups.begin(), table.groups.end(), same);
        if (group == table.groups.end()) group = table.groups.insert(group, {option->get_group(), {}});
        group->options.push_back(row_of(*option));
    }
    return table;
}

}  // namespace

ProgramTable program_table(const CLI::App& app) {
    ProgramTable table{table_of(app), {}};
    for (const CLI::App* command : app.get_subcommands([](const CLI::App* any) { return !any->get_group().empty(); })) {
        table.commands.push_back(table_of(*command));
    }
    return table;
}

std::vector<OptionRow> all_options(const CommandTable& command) {
    std::vector<OptionRow> options;
    for (const OptionGroup& group : command.groups) {
        options.insert(options.end(), group.options.begin(), group.options.end());
    }
    return options;
}

std::vector<std::string> listed_choices(const std::string& description) {
    std::string list = without(description, "\\([^)]*\\)");
    list = list.substr(0, list.find(';'));
    if (const std::size_t colon = list.rfind(": "); colon != std::string::npos) list = list.substr(colon + 2);
    list = without(list, "^One of ");
    list = without(list, ",? +or +", ",");
    list = without(list, " *, *", ",");
    list = without(list, "^ +| +$");
    if (!std::regex_match(list, std::regex("[a-z0-9][a-z0-9_-]*(,[a-z0-9][a-z0-9_-]*)+"))) return {};
    std::vector<std::string> choices;
    for (std::size_t begin = 0; begin < list.size();) {
        const std::size_t end = std::min(list.find(',', begin), list.size());
        choices.push_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    return choices;
}

}  // namespace raylign::detail::apps
