#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/options.h"

namespace raylign::apps {

inline constexpr const char* kInputGroup = "Input";
inline constexpr const char* kStartGroup = "Start and geometry";
inline constexpr const char* kMethodGroup = "Method";
inline constexpr const char* kBackendGroup = "Backend";
inline constexpr const char* kOutputGroup = "Output";

/// Name, version and layout of the help.
void set_up_program(CLI::App& app);

/// An option with the word that stands for its value in the help; the description names the default.
CLI::Option* describe(CLI::Option* option, const std::string& value_word, const char* group);

/// Options that several sub-commands share.
void add_volume_flags(CLI::App& command, VolumeFlags& flags);
void add_engine_flags(CLI::App& command, EngineFlags& flags);

/// Examples below the options, and --help at the end of the last group.
void finish_command(CLI::App& command, const std::string& examples);

}  // namespace raylign::apps
