#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "apps/generate/texts.h"
#include "apps/shared/commands.h"
#include "apps/shared/help.h"
#include "core/base/error.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {
namespace {

struct GenerateOptions {
    std::string kind;
    std::filesystem::path folder;
};

std::vector<GeneratedFile> generated(const std::string& kind, const ProgramTable& table) {
    if (kind == "man") return man_pages(table);
    if (kind == "bash") return {bash_completion(table)};
    if (kind == "zsh") return {zsh_completion(table)};
    if (kind == "fish") return {fish_completion(table)};
    throw bad_value("what to generate", kind, "man, bash, zsh or fish");
}

int run_generate(const GenerateOptions& options, const CLI::App& app) {
    const std::vector<GeneratedFile> files = generated(options.kind, program_table(app));
    OutputFolder folder(options.folder);
    for (const GeneratedFile& file : files) write_text(folder.stage(file.name), file.text);
    folder.commit();
    return 0;
}

}  // namespace

void add_generate_command(CLI::App& app, Job& job) {
    const auto options = std::make_shared<GenerateOptions>();
    CLI::App& command = *app.add_subcommand("generate", "Write what packages of this program hold beside it");
    command.add_option("kind", options->kind, "man, bash, zsh or fish")->required()->option_text("(required)");
    describe(command.add_option("-o,--output", options->folder, "Folder for man pages or the completion")->required(),
             "DIR (required)", kOutputGroup);
    finish_command(command, "  raylign generate man -o share/man/man1");
    command.group("");  // for those who make packages: the help does not show it
    command.callback(
        [options, &app, &job] { job = [options, &app](const Invocation&) { return run_generate(*options, app); }; });
}

}  // namespace raylign::detail::apps
