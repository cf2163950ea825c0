#pragma once

#include <string>
#include <vector>

#include "apps/generate/option_tables.h"

namespace raylign::detail::apps {

struct GeneratedFile {
    std::string name, text;
};

/// raylign.1 and raylign-COMMAND.1 of each command, for man.
[[nodiscard]] std::vector<GeneratedFile> man_pages(const ProgramTable& table);

/// What completes commands, options, their values and files in a shell.
[[nodiscard]] GeneratedFile bash_completion(const ProgramTable& table);
[[nodiscard]] GeneratedFile zsh_completion(const ProgramTable& table);
[[nodiscard]] GeneratedFile fish_completion(const ProgramTable& table);

/// `register` as a command-line module of 3D Slicer, in its XML. `command`: the table of `register`.
/// Source: https://www.slicer.org/wiki/Documentation/Nightly/Developers/SlicerExecutionModel
[[nodiscard]] std::string slicer_module(const CommandTable& command);

}  // namespace raylign::detail::apps
