#include "apps/shared/help.h"

#include "apps/shared/build_info.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

/// CLI11's layout with one blank line between groups instead of two.
class Layout final : public CLI::Formatter {
public:
    Layout() { column_width(28); }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
        return CLI::detail::find_and_replace(CLI::Formatter::make_help(app, std::move(name), mode), "\n\n\n", "\n\n");
    }
};

}  // namespace

std::string version_line() {
    return std::string("raylign " RAYLIGN_VERSION " (commit ") + build_commit() + ", " + build_options() + ")";
}

void set_up_program(CLI::App& app) {
    app.name("raylign");
    app.description("Finds where a CT stands in X-ray images: 2-D/3-D rigid registration.");
    app.formatter(std::make_shared<Layout>());
    app.set_version_flag("--version", version_line(), "Print version, commit and what was built in, and exit");
    app.set_help_flag("-h,--help", "Print this help and exit");
    app.get_formatter()->label("SUBCOMMAND", "COMMAND");
    app.get_formatter()->label("Positionals", "What to make");
    app.require_subcommand(1);
    app.footer(
        "From a synthetic CT to a registration (views.json: where the X-ray sources and detectors are):\n"
        "  raylign phantom spine -o spine.mha\n"
        "  raylign drr -v spine.mha --attenuation --views views.json --pose pose.json -o xrays\n"
        "  raylign register -v spine.mha --attenuation --views xrays/views.json -o result\n"
        "`raylign COMMAND --help` lists the options of a command, `raylign help` the topics of the manual in short.\n"
        "Exit codes: 0 done, 1 ran but is doubtful, 2 bad input or usage, 3 backend not available, 4 done but "
        "standard\n"
        "output failed, 130 interrupted.");
}

CLI::Option* describe(CLI::Option* option, const std::string& value_word, const char* group) {
    return option->option_text(value_word)->group(group);
}

void finish_command(CLI::App& command, const std::string& examples) {
    command.set_help_flag("-h,--help", "Print this help and exit")->group(kOutputGroup);
    command.group("Commands");
    command.footer("Examples:\n" + examples);
}

}  // namespace raylign::detail::apps
