#include <CLI/CLI.hpp>
#include <algorithm>
#include <regex>
#include <sstream>

#include "apps/generate/texts.h"
#include "apps/shared/commands.h"
#include "core/base/error.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// An option of `register` that makes sense in 3D Slicer, and its element there. Others keep their defaults: Slicer
/// passes every number that it shows, and many of ours have no number for "not given". An empty text is not passed.
struct SlicerParameter {
    const char *option, *element, *attributes, *channel;
};

struct SlicerGroup {
    const char* label;
    std::vector<SlicerParameter> parameters;
};

std::vector<SlicerGroup> slicer_groups() {
    return {{"Input",
             {{"--volume", "image", "", "input"},
              {"--attenuation", "boolean", "", ""},
              {"--views", "file", " fileExtensions=\".json,.txt,.xml,.yml,.cfg\"", "input"},
              {"--auto-mask", "boolean", "", ""},
              {"--start", "file", " fileExtensions=\".json,.tfm,.tra,.jts\"", "input"}}},
            {"Object", {{"--labels", "image", " type=\"label\"", "input"}, {"--bone-threshold", "string", "", ""}}},
            {"Method",
             {{"--method", "string-enumeration", "", ""},
              {"--content", "string-enumeration", "", ""},
              {"--search", "string-enumeration", "", ""},
              {"--no-robust", "boolean", "", ""},
              {"--refine-views", "boolean", "", ""},
              {"--backend", "string-enumeration", "", ""},
              {"--threads", "integer", "", ""}}},
            {"Output", {{"--output", "directory", "", "output"}}}};
}

std::string xml_text(const std::string& text) {
    std::string escaped;
    for (const char c : text) {
        if (c == '&') {
            escaped += "&amp;";
        } else if (c == '<') {
            escaped += "&lt;";
        } else if (c == '>') {
            escaped += "&gt;";
        } else {
            escaped += c;
        }
    }
    return escaped;
}

void write_element(std::ostream& out, const std::string& name, const std::string& text) {
    out << "      <" << name << ">" << xml_text(text) << "</" << name << ">\n";
}

/// "bone-threshold" as "Bone threshold", or with '_' as what scripts call it.
std::string spaced(std::string word, char space) {
    std::replace(word.begin(), word.end(), '-', space);
    if (space == ' ') word.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(word.front())));
    return word;
}

/// What the description calls the default, where Slicer wants one.
std::string default_of(const OptionRow& row, const std::string& element) {
    if (element == "boolean") return "false";
    std::smatch found;
    const std::regex pattern("default:? ([a-z0-9-]+)");
    const bool needs_one = element == "string-enumeration" || element == "integer";
    return needs_one && std::regex_search(row.description, found, pattern) ? found[1].str() : "";
}

void write_slicer_parameter(std::ostream& out, const OptionRow& row, const SlicerParameter& parameter) {
    const std::string element = parameter.element;
    const std::string word = row.names.back().substr(2), value = default_of(row, element);
    out << "    <" << element << parameter.attributes << ">\n";
    write_element(out, "name", spaced(word, '_'));
    if (row.names.size() > 1) write_element(out, "flag", row.names.front());
    write_element(out, "longflag", row.names.back());
    write_element(out, "label", spaced(word, ' '));
    write_element(out, "description", row.description);
    if (!value.empty()) write_element(out, "default", value);
    if (element == "string-enumeration") {
        for (const std::string& choice : row.choices) write_element(out, "element", choice);
    }
    if (*parameter.channel != '\0') write_element(out, "channel", parameter.channel);
    out << "    </" << element << ">\n";
}

}  // namespace

std::string slicer_module(const CommandTable& command) {
    const std::vector<OptionRow> options = all_options(command);
    std::ostringstream out;
    out << "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n  <category>Registration</category>\n"
        << "  <title>raylign: CT to X-rays</title>\n"
        << "  <description>" << xml_text(command.description) << "</description>\n"
        << "  <version>" << RAYLIGN_VERSION << "</version>\n  <license>Apache-2.0</license>\n"
        << "  <contributor>The raylign developers</contributor>\n";
    for (const SlicerGroup& group : slicer_groups()) {
        out << "  <parameters>\n    <label>" << group.label << "</label>\n    <description>" << group.label
            << "</description>\n";
        for (const SlicerParameter& parameter : group.parameters) {
            const auto row = std::find_if(options.begin(), options.end(), [&parameter](const OptionRow& any) {
                return any.names.back() == parameter.option;
            });
            if (row == options.end()) throw bad_value("option of register", parameter.option, "one of its help");
            write_slicer_parameter(out, *row, parameter);
        }
        out << "  </parameters>\n";
    }
    out << "</executable>";
    return out.str();
}

void add_slicer_flag(CLI::App& app) {
    CLI::App& command = *app.get_subcommand("register");
    command
        .add_flag_callback(
            "--xml",
            [&app, &command] {
                const ProgramTable table = program_table(app);
                const auto is_it = [&command](const CommandTable& any) { return any.name == command.get_name(); };
                throw CLI::CallForVersion(
                    slicer_module(*std::find_if(table.commands.begin(), table.commands.end(), is_it)), 0);
            },
            "Describe this command to 3D Slicer")
        ->group("");
}

}  // namespace raylign::detail::apps
