#include <sstream>

#include "apps/generate/texts.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

std::string with_between(const std::vector<std::string>& words, const char* between) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
    return text;
}

std::string names_of(const std::vector<OptionRow>& options) {
    std::vector<std::string> names;
    for (const OptionRow& row : options) names.insert(names.end(), row.names.begin(), row.names.end());
    return with_between(names, " ");
}

/// Shell variables that say what may stand as the value.
std::string bash_value(const OptionRow& row) {
    std::string text;
    if (row.kind == ValueKind::file) text = "kind=file";
    if (row.kind == ValueKind::folder) text = "kind=folder";
    if (row.kind == ValueKind::choice) text = "kind=choice values=\"" + with_between(row.choices, " ") + "\"";
    if (row.kind == ValueKind::other) text = "kind=other";
    return text + (row.takes_several ? " several=yes" : "");
}

void write_bash_command(std::ostream& out, const CommandTable& command) {
    const std::vector<OptionRow> options = all_options(command);
    out << "        " << command.name << ")\n            options=\"" << names_of(options) << "\"\n"
        << "            case $option in\n";
    for (const OptionRow& row : options) {
        if (row.kind == ValueKind::none) continue;
        out << "                " << with_between(row.names, "|") << ") " << bash_value(row) << " ;;\n";
    }
    out << "            esac\n";
    for (const OptionRow& row : command.positionals) {
        if (row.kind == ValueKind::choice) {
            out << "            positionals=\"" << with_between(row.choices, " ") << "\"\n";
        }
    }
    out << "            ;;\n";
}

/// `option` is the last one before the cursor. Words are split at '=', as in NAME=FILE.
constexpr const char* kBegin = R"(_raylign() {
    local IFS=$' \t\n' cur=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} last=$((COMP_CWORD - 1))
    local option kind= values= several= options= positionals=
    COMPREPLY=()
    while [ "$last" -gt 1 ] && [[ ${COMP_WORDS[last]} != -?* ]]; do last=$((last - 1)); done
    option=${COMP_WORDS[last]}
    case ${COMP_WORDS[1]} in
)";

constexpr const char* kEnd = R"(    esac
    if [ "$cur" = = ]; then
        cur= before==
    fi
    if [ "$COMP_CWORD" -le 1 ]; then
        kind=choice values=$commands
    elif [[ $cur == -* ]]; then
        kind=choice values=$options
    elif [ -z "$kind" ] || { [ $((COMP_CWORD - last)) -gt 1 ] && [ -z "$several" ] && [ "$before" != = ]; }; then
        kind=file values=
        [ -z "$positionals" ] || kind=choice values=$positionals
    fi
    case $kind in
        choice) COMPREPLY=($(compgen -W "$values" -- "$cur")) ;;
        file) IFS=$'\n' COMPREPLY=($(compgen -f -- "$cur")) ;;
        folder) IFS=$'\n' COMPREPLY=($(compgen -d -- "$cur")) ;;
    esac
    case $kind in file | folder) compopt -o filenames 2>/dev/null ;; esac
    return 0
}
complete -F _raylign raylign
)";

}  // namespace

GeneratedFile bash_completion(const ProgramTable& table) {
    std::ostringstream out;
    std::vector<std::string> first;
    for (const CommandTable& command : table.commands) first.push_back(command.name);
    first.push_back(names_of(all_options(table.program)));
    out << "# Completes raylign " RAYLIGN_VERSION " in bash.\n" << kBegin;
    for (const CommandTable& command : table.commands) write_bash_command(out, command);
    std::string end = kEnd;
    end.replace(end.find("$commands"), std::string("$commands").size(), "\"" + with_between(first, " ") + "\"");
    out << end;
    return {"raylign", out.str()};
}

}  // namespace raylign::detail::apps
