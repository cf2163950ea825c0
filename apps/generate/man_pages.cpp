#include <algorithm>
#include <sstream>

#include "apps/generate/texts.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// Text as roff takes it: its own signs, and hyphens that can be copied.
std::string roff(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n')) escaped += "\\&";
        if (c == '\\') {
            escaped += "\\(rs";
        } else if (c == '-') {
            escaped += "\\-";
        } else {
            escaped += c;
        }
    }
    return escaped;
}

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
    return text;
}

std::string item(const OptionRow& row) {
    std::string names;
    for (const std::string& name : row.names) names += (names.empty() ? "" : ", ") + ("\\fB" + roff(name) + "\\fR");
    if (!row.value.empty()) names += (names.empty() ? "" : " ") + ("\\fI" + roff(row.value) + "\\fR");
    const std::string required = row.is_required ? " (required)" : "";
    return ".TP\n" + names + required + "\n" + roff(row.description) + ".\n";
}

/// Words are not hyphenated: they are names.
std::string title(const std::string& page) {
    return ".TH " + upper(page) + " 1 \"\" \"raylign " RAYLIGN_VERSION "\" \"raylign\"\n.nh\n.ad l\n";
}

/// The footer of the help, as it stands there.
std::string literal(const std::string& text) { return ".nf\n" + roff(text) + "\n.fi\n"; }

constexpr const char* kExitStatus =
    ".SH EXIT STATUS\n"
    "0 done, 1 ran but is doubtful, 2 bad input or usage, 3 backend not available, 4 done but standard output failed, "
    "130 interrupted.\n";

std::string command_page(const CommandTable& command) {
    std::ostringstream page;
    page << title("raylign-" + command.name) << ".SH NAME\n"
         << "raylign\\-" << roff(command.name) << " \\- " << roff(command.description) << "\n"
         << ".SH SYNOPSIS\n.B raylign " << roff(command.name) << "\n";
    for (const OptionRow& row : command.positionals) page << ".I " << roff(row.value) << "\n";
    for (const OptionRow& row : all_options(command)) {
        if (row.is_required) page << "\\fB" << roff(row.names.back()) << "\\fR \\fI" << roff(row.value) << "\\fR\n";
    }
    page << "[options]\n";
    if (!command.positionals.empty()) page << ".SH ARGUMENTS\n";
    for (const OptionRow& row : command.positionals) page << item(row);
    page << ".SH OPTIONS\n";
    for (const OptionGroup& group : command.groups) {
        page << ".SS " << roff(group.name) << "\n";
        for (const OptionRow& row : group.options) page << item(row);
    }
    const std::string heading = "Examples:\n";
    const bool has_heading = command.footer.starts_with(heading);
    page << ".SH EXAMPLES\n" << literal(has_heading ? command.footer.substr(heading.size()) : command.footer);
    page << kExitStatus << ".SH SEE ALSO\n.BR raylign (1)\n";
    return page.str();
}

std::string program_page(const ProgramTable& table) {
    std::ostringstream page;
    page << title("raylign") << ".SH NAME\nraylign \\- 2\\-D/3\\-D rigid registration of CT volumes to X\\-ray images\n"
         << ".SH SYNOPSIS\n.B raylign\n.I COMMAND\n[options]\n"
         << ".SH DESCRIPTION\n"
         << roff(table.program.description) << "\n.SH OPTIONS\n";
    for (const OptionRow& row : all_options(table.program)) page << item(row);
    page << ".SH COMMANDS\n";
    for (const CommandTable& command : table.commands) {
        page << ".TP\n\\fB" << roff(command.name) << "\\fR\n" << roff(command.description) << ".\n";
    }
    page << ".SH NOTES\n" << literal(table.program.footer) << ".SH SEE ALSO\n";
    for (const CommandTable& command : table.commands) {
        const bool is_last = &command == &table.commands.back();
        page << ".BR raylign\\-" << roff(command.name) << (is_last ? " (1)\n" : " (1),\n");
    }
    return page.str();
}

}  // namespace

std::vector<GeneratedFile> man_pages(const ProgramTable& table) {
    std::vector<GeneratedFile> pages{{"raylign.1", program_page(table)}};
    for (const CommandTable& command : table.commands) {
        pages.push_back({"raylign-" + command.name + ".1", command_page(command)});
    }
    return pages;
}

}  // namespace raylign::detail::apps
