#include <iostream>

#include "apps/help/topics.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace raylign::detail::apps {
namespace {

std::vector<std::string> topic_names() {
    std::vector<std::string> names;
    for (const Topic& topic : topics()) names.emplace_back(topic.name);
    return names;
}

int print_topics() {
    std::cout << "raylign help TOPIC, one of:\n";
    for (const std::string& name : topic_names()) std::cout << "  " << name << "\n";
    std::cout << "Each is the first section of a page of the manual (docs/ of the sources). `raylign COMMAND --help` "
                 "lists the\n"
                 "options of a command.\n";
    return 0;
}

int print_topic(const std::string& name) {
    if (name.empty()) return print_topics();
    for (const Topic& topic : topics()) {
        if (topic.name != name) continue;
        std::cout << topic.text;
        return 0;
    }
    throw bad_value("topic", name, "one of " + joined(topic_names()));
}

}  // namespace

void add_help_command(CLI::App& app, Job& job) {
    const auto name = std::make_shared<std::string>();
    CLI::App& command = *app.add_subcommand("help", "Print the short form of a page of the manual");
    command
        .add_option("topic", *name,
                    "start, geometry, method, trust, files, limits, bones or place; default: the list of topics")
        ->option_text("NAME");
    finish_command(command, "  raylign help\n  raylign help geometry");
    command.callback([name, &job] { job = [name](const Invocation&) { return print_topic(*name); }; });
}

}  // namespace raylign::detail::apps
