#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string_view>
#include <system_error>

#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/plain_output.h"
#include "core/base/error.h"
#include "core/base/fault_text.h"
#include "core/base/plain_text.h"
#include "core/base/text.h"
#include "core/io/files/temporary_file.h"
#include "raylign/io/decoding.h"

namespace {

/// CLI11 does not name a mistyped command: it finds none.
std::string usage_problem(const CLI::App& app, const std::string& found, int argc, char** argv) {
    if (!app.get_subcommands().empty() || argc < 2 || argv[1][0] == '-') return found + " (--help lists the options)";
    std::vector<std::string> valid;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App* any) { return !any->get_group().empty(); })) {
        valid.push_back(command->get_name());
    }
    return raylign::detail::bad_value("command", argv[1], "one of " + raylign::detail::joined(valid)).what();
}

int complain(const CLI::App& app, const std::string& message, int code) {
    const auto chosen = app.get_subcommands();
    const std::string command = chosen.empty() ? "" : " " + chosen.front()->get_name();
    std::cerr << "raylign" + command + ": " + raylign::detail::plain_message(message) + "\n";  // in one piece
    return code;
}

/// A thread that the system does not give is a device that is not there.
int exit_code_of_fault(const std::exception& fault) {
    const bool is_file = dynamic_cast<const std::filesystem::filesystem_error*>(&fault) != nullptr;
    const bool is_system = dynamic_cast<const std::system_error*>(&fault) != nullptr;
    return raylign::detail::apps::exit_code_of(is_system && !is_file ? raylign::ErrorKind::unavailable
                                                                     : raylign::ErrorKind::input);
}

int run(int argc, char** argv) {
    raylign::detail::apps::catch_interrupts();
    raylign::detail::apps::PlainOutput output(std::cout, STDOUT_FILENO), errors(std::cerr, STDERR_FILENO);
    CLI::App app;
    try {
        raylign::detail::apps::Job job;
        raylign::detail::apps::set_up_program(app);
        raylign::detail::apps::add_register_command(app, job);
        raylign::detail::apps::add_track_command(app, job);
        raylign::detail::apps::add_place_command(app, job);
        raylign::detail::apps::add_batch_command(app, job);
        raylign::detail::apps::add_drr_command(app, job);
        raylign::detail::apps::add_study_command(app, job);
        raylign::detail::apps::add_compare_command(app, job);
        raylign::detail::apps::add_bench_command(app, job);
        raylign::detail::apps::add_phantom_command(app, job);
        raylign::detail::apps::add_geometry_command(app, job);
        raylign::detail::apps::add_poses_command(app, job);
        raylign::detail::apps::add_import_command(app, job);
        raylign::detail::apps::add_info_command(app, job);
        raylign::detail::apps::add_help_command(app, job);
        raylign::detail::apps::add_generate_command(app, job);
        raylign::detail::apps::add_slicer_flag(app);
        app.parse(argc, argv);
        const int code = job({raylign::detail::apps::quote_for_shell({argv, argv + argc})});
        if (std::cout.flush()) return code;
        return complain(app,
                        "standard output cannot be written: " + raylign::detail::system_reason(output.failure()) +
                            "; all else is done, and files that were to be written are",
                        raylign::detail::apps::kOutputFailed);
    } catch (const CLI::Success& help_or_version) {
        return app.exit(help_or_version);
    } catch (const CLI::ParseError& error) {
        return complain(app, usage_problem(app, error.what(), argc, argv), 2);
    } catch (const raylign::Error& error) {
        return complain(app, error.what(), raylign::detail::apps::exit_code_of(error.kind()));
    } catch (const raylign::detail::apps::Interrupted& interrupted) {
        return complain(app, interrupted.what(), 130);
    } catch (const std::exception& fault) {
        return complain(app, raylign::detail::fault_text(fault), exit_code_of_fault(fault));
    }
}

/// RAYLIGN_DECODE=in-process: for debuggers, which do not follow into the process that decodes a file.
void start_decoding() {
    const char* wish = std::getenv("RAYLIGN_DECODE");
    if (wish != nullptr && std::string_view(wish) == "in-process") {
        raylign::set_decoding(raylign::Decoding::in_process);
    }
    raylign::start_decoding_server();
}

}  // namespace

int main(int argc, char** argv) {
    try {
        raylign::detail::apps::hold_standard_streams();
        start_decoding();  // before there are threads, MPI and graphics
        return run(argc, argv);
    } catch (...) {  // thrown while complaining
        std::fputs("raylign: not enough memory\n", stderr);
        return 2;
    }
}
