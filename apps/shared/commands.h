#pragma once

#include <functional>

#include "apps/shared/invocation.h"

namespace CLI {
class App;
}

namespace raylign::detail::apps {

/// What the command line asks for; returns the exit code.
using Job = std::function<int(const Invocation&)>;

/// Each adds its sub-command to `app`; when the command line names it, `job` becomes its work.
void add_register_command(CLI::App& app, Job& job);
void add_place_command(CLI::App& app, Job& job);
void add_drr_command(CLI::App& app, Job& job);
void add_geometry_command(CLI::App& app, Job& job);
void add_poses_command(CLI::App& app, Job& job);
void add_import_command(CLI::App& app, Job& job);
void add_info_command(CLI::App& app, Job& job);
void add_help_command(CLI::App& app, Job& job);
void add_generate_command(CLI::App& app, Job& job);
/// `register --xml`: what 3D Slicer asks a command-line module for. After the commands.
void add_slicer_flag(CLI::App& app);
void add_phantom_command(CLI::App& app, Job& job);
void add_track_command(CLI::App& app, Job& job);
void add_study_command(CLI::App& app, Job& job);
void add_compare_command(CLI::App& app, Job& job);
void add_bench_command(CLI::App& app, Job& job);
void add_batch_command(CLI::App& app, Job& job);

}  // namespace raylign::detail::apps
