#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/shared/options.h"

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

/// Options that several sub-commands share.
void add_volume_flags(CLI::App& command, VolumeFlags& flags);
void add_object_flags(CLI::App& command, VolumeFlags& flags);  ///< part of the volume's
void add_engine_flags(CLI::App& command, EngineFlags& flags);

/// --views of one or several files. `what`: what the command takes from them.
void add_views_option(CLI::App& command, std::vector<std::string>& views, const std::string& what);

/// --seed, a whole number in [0, 2^64): the parser itself would let -1 wrap around.
void add_seed_option(CLI::App& command, std::uint64_t& seed, const std::string& what);

/// Examples below the options, and --help at the end of the last group.
void finish_command(CLI::App& command, const std::string& examples);

}  // namespace raylign::detail::apps
