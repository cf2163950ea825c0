#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace raylign::detail::apps {

// The tables of options behind --help, as man pages, completions and descriptions for other programs need them.

enum class ValueKind { none, file, folder, choice, other };

struct OptionRow {
    std::vector<std::string> names;    ///< "-v", "--volume"; empty for what stands without a name
    std::string value;                 ///< word for the value, "FILE ..."; empty for a flag
    std::string description;           ///< on one line
    std::vector<std::string> choices;  ///< all allowed values, where the description lists them
    ValueKind kind = ValueKind::none;
    bool is_required = false;
    bool takes_several = false;  ///< values behind one name
};

struct OptionGroup {
    std::string name;
    std::vector<OptionRow> options;
};

struct CommandTable {
    std::string name, description;
    std::vector<OptionRow> positionals;
    std::vector<OptionGroup> groups;
    std::string footer;  ///< "Examples:" and lines
};

struct ProgramTable {
    CommandTable program;  ///< options without a command
    std::vector<CommandTable> commands;
};

/// The commands that the help shows, in its order.
[[nodiscard]] ProgramTable program_table(const CLI::App& app);

/// The options of all groups, in their order.
[[nodiscard]] std::vector<OptionRow> all_options(const CommandTable& command);

/// The values that a description lists: "On gl: a, b (why) or c; default a" gives a, b, c. None where it lists none.
[[nodiscard]] std::vector<std::string> listed_choices(const std::string& description);

}  // namespace raylign::detail::apps
