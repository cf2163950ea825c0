#include <cstdio>
#include <iostream>
#include <new>

#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/help.h"
#include "apps/shared/interrupt.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace {

/// CLI11 does not name a mistyped command: it finds none.
std::string usage_problem(const CLI::App& app, const std::string& found, int argc, char** argv) {
    if (!app.get_subcommands().empty() || argc < 2 || argv[1][0] == '-') return found + " (--help lists the options)";
    std::vector<std::string> valid;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
        valid.push_back(command->get_name());
    }
    return raylign::detail::bad_value("command", argv[1], "one of " + raylign::detail::joined(valid)).what();
}

int complain(const CLI::App& app, const std::string& message, int code) {
    const auto chosen = app.get_subcommands();
    std::cerr << "raylign" << (chosen.empty() ? "" : " " + chosen.front()->get_name()) << ": " << message << "\n";
    return code;
}

int run(int argc, char** argv) {
    raylign::detail::apps::catch_interrupts();
    CLI::App app;
    try {
        raylign::detail::apps::Job job;
        raylign::detail::apps::set_up_program(app);
        raylign::detail::apps::add_register_command(app, job);
        raylign::detail::apps::add_track_command(app, job);
        raylign::detail::apps::add_drr_command(app, job);
        raylign::detail::apps::add_study_command(app, job);
        raylign::detail::apps::add_compare_command(app, job);
        raylign::detail::apps::add_bench_command(app, job);
        raylign::detail::apps::add_phantom_command(app, job);
        raylign::detail::apps::add_geometry_command(app, job);
        raylign::detail::apps::add_poses_command(app, job);
        raylign::detail::apps::add_import_command(app, job);
        raylign::detail::apps::add_info_command(app, job);
        app.parse(argc, argv);
        const int code = job({raylign::detail::apps::quote_for_shell({argv, argv + argc})});
        if (!std::cout.flush()) throw raylign::Error("cannot write to standard output: is the disk full?");
        return code;
    } catch (const CLI::Success& help_or_version) {
        return app.exit(help_or_version);
    } catch (const CLI::ParseError& error) {
        return complain(app, usage_problem(app, error.what(), argc, argv), 2);
    } catch (const raylign::Error& error) {
        return complain(app, error.what(), raylign::detail::apps::exit_code_of(error.kind()));
    } catch (const raylign::detail::apps::Interrupted& interrupted) {
        return complain(app, interrupted.what(), 130);
    } catch (const std::bad_alloc&) {
        return complain(app, "not enough memory for this volume and these images", 2);
    } catch (const std::exception& error) {
        return complain(app, error.what(), 2);
    }
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (...) {  // thrown while complaining
        std::fputs("raylign: not enough memory\n", stderr);
        return 2;
    }
}
