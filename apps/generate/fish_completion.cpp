#include <algorithm>
#include <sstream>

#include "apps/generate/texts.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

std::string fish_quoted(const std::string& text) {
    std::string quoted = "'";
    for (const char c : text) {
        if (c == '\'' || c == '\\') quoted += '\\';
        quoted += c;
    }
    return quoted + "'";
}

std::string choices_of(const OptionRow& row) {
    std::string list;
    for (const std::string& choice : row.choices) list += (list.empty() ? "" : " ") + choice;
    return fish_quoted(list);
}

/// fish offers files beside the choices, unless told that there are none.
bool takes_files(const CommandTable& command) {
    return std::ranges::any_of(command.positionals, [](const OptionRow& row) { return row.kind != ValueKind::choice; });
}

void write_fish_option(std::ostream& out, const OptionRow& row, const std::string& condition) {
    out << "complete -c raylign -n " << condition;
    for (const std::string& name : row.names) {
        out << (name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1));
    }
    if (row.kind == ValueKind::file) out << " -rF";
    if (row.kind == ValueKind::folder) out << " -xa '(__fish_complete_directories)'";
    if (row.kind == ValueKind::choice) out << " -xa " << choices_of(row);
    if (row.kind == ValueKind::other) out << " -x";
    out << " -d " << fish_quoted(row.description) << "\n";
}

}  // namespace

GeneratedFile fish_completion(const ProgramTable& table) {
    std::ostringstream out;
    out << "# Completes raylign " RAYLIGN_VERSION " in fish.\n";
    for (const OptionRow& row : all_options(table.program)) write_fish_option(out, row, "__fish_use_subcommand");
    for (const CommandTable& command : table.commands) {
        out << "complete -c raylign -n __fish_use_subcommand -fa " << command.name << " -d "
            << fish_quoted(command.description) << "\n";
    }
    for (const CommandTable& command : table.commands) {
        const std::string here = "'__fish_seen_subcommand_from " + command.name + "'";
        for (const OptionRow& row : all_options(command)) write_fish_option(out, row, here);
        for (const OptionRow& row : command.positionals) {
            if (row.kind != ValueKind::choice) continue;
            out << "complete -c raylign -n " << here << (takes_files(command) ? " -a " : " -fa ") << choices_of(row)
                << "\n";
        }
    }
    return {"raylign.fish", out.str()};
}

}  // namespace raylign::detail::apps
