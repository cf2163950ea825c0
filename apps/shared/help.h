#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace raylign::detail::apps {

inline constexpr const char* kInputGroup = "Input";
inline constexpr const char* kObjectGroup = "Object";
inline constexpr const char* kStartGroup = "Start and geometry";
inline constexpr const char* kMethodGroup = "Method";
inline constexpr const char* kSearchGroup = "Search";
inline constexpr const char* kBackendGroup = "Backend";
inline constexpr const char* kOutputGroup = "Output";

/// Name, version and layout of the help.
void set_up_program(CLI::App& app);

/// An option with the word that stands for its value in the help; the description names the default.
CLI::Option* describe(CLI::Option* option, const std::string& value_word, const char* group);

/// Examples below the options, and --help at the end of the last group.
void finish_command(CLI::App& command, const std::string& examples);

}  // namespace raylign::detail::apps
