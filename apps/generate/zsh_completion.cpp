#include <sstream>

#include "apps/generate/texts.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// Inside single quotes, where _arguments takes brackets and colons for its own.
std::string zsh_text(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if (c == '\'') {
            escaped += "'\\''";
        } else if (c == '[' || c == ']' || c == ':' || c == '\\') {
            escaped += std::string("\\") + c;
        } else {
            escaped += c;
        }
    }
    return escaped;
}

std::string zsh_value(const OptionRow& row) {
    std::string action = " ";  // a value of which nothing is known
    if (row.kind == ValueKind::file) action = "_files";
    if (row.kind == ValueKind::folder) action = "_files -/";
    if (row.kind == ValueKind::choice) {
        action = "(";
        for (const std::string& choice : row.choices) action += (action.size() > 1 ? " " : "") + choice;
        action += ")";
    }
    return ":" + zsh_text(row.value) + ":" + action;
}

void write_zsh_option(std::ostream& out, const OptionRow& row) {
    for (const std::string& name : row.names) {
        out << "            '*" << name << "[" << zsh_text(row.description) << "]";
        if (row.kind != ValueKind::none) out << zsh_value(row);
        out << "' \\\n";
    }
}

void write_zsh_command(std::ostream& out, const CommandTable& command) {
    out << "        " << command.name << ")\n          _arguments \\\n";
    for (const OptionRow& row : all_options(command)) write_zsh_option(out, row);
    for (const OptionRow& row : command.positionals) {
        out << "            '" << (row.takes_several ? "*" : "") << zsh_value(row) << "' \\\n";
    }
    out << "            && return 0 ;;\n";
}

}  // namespace

GeneratedFile zsh_completion(const ProgramTable& table) {
    std::ostringstream out;
    out << "#compdef raylign\n# Completes raylign " RAYLIGN_VERSION " in zsh.\n"
        << "_raylign() {\n    local context state state_descr line ret=1\n    typeset -A opt_args\n"
        << "    _arguments -C \\\n";
    for (const OptionRow& row : all_options(table.program)) write_zsh_option(out, row);
    out << "        '1:command:->command' '*::arguments:->arguments' && return 0\n"
        << "    case $state in\n    command)\n        local -a commands=(\n";
    for (const CommandTable& command : table.commands) {
        out << "            '" << command.name << ":" << zsh_text(command.description) << "'\n";
    }
    out << "        )\n        _describe command commands && ret=0 ;;\n    arguments)\n        case $line[1] in\n";
    for (const CommandTable& command : table.commands) write_zsh_command(out, command);
    out << "        esac ;;\n    esac\n    return ret\n}\n_raylign \"$@\"\n";
    return {"_raylign", out.str()};
}

}  // namespace raylign::detail::apps
