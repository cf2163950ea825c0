#include "apps/shared/flags.h"

namespace raylign::detail::apps {

void add_auto_mask_flag(CLI::App& command, RegisterOptions& options) {
    command
        .add_flag("--auto-mask", options.auto_mask,
                  "Leave out collimator, shutter, letters, saturated and zero pixels; default off")
        ->group(kInputGroup);
}

void add_method_flags(CLI::App& command, RegisterOptions& options) {
    describe(
        command.add_option("--method", options.method, "auto, gauss-newton, steepest-descent or bobyqa; default auto"),
        "NAME", kMethodGroup);
    describe(command.add_option("--metric", options.metric, "gc (gradient correlation) or ncc; default gc"), "NAME",
             kMethodGroup);
    describe(command.add_option("--content", options.content,
                                "What the CT explains of the X-ray: whole, part (one bone among other tissue)\n"
                                "or auto; default auto: part where whole correlates weakly"),
             "NAME", kMethodGroup);
    command
        .add_flag("--no-robust", options.no_robust,
                  "Do not weigh down what the DRR cannot explain (metal, other tissue); default off")
        ->group(kMethodGroup);
    describe(command.add_option("--levels", options.levels,
                                "Resolutions, coarse to fine, 1 to 8; default 0: down to about 32 px"),
             "N", kMethodGroup);
    describe(command.add_option("--max-iterations", options.max_iterations, "Most steps per level; default 100"), "N",
             kMethodGroup);
    add_seed_option(command, options.seed, "For methods that draw random numbers");
}

void add_search_flags(CLI::App& command, RegisterOptions& options) {
    describe(command.add_option("--search", options.search,
                                "Other starts: none, near (around the start), global (anywhere in the field of\n"
                                "view) or auto; default auto: near where the content is part, else none"),
             "NAME", kSearchGroup);
    describe(command.add_option("--search-range", options.search_range_mm,
                                "near: how far the object may be off, up to 500; default 20"),
             "MM", kSearchGroup);
    describe(command.add_option("--search-turn", options.search_turn_deg,
                                "Largest turn from the start, up to 180; default 60 near, 45 global"),
             "DEG", kSearchGroup);
    describe(
        command.add_option("--search-starts", options.search_starts,
                           "Poses tried for a whole; default 6144 near, 8192 global;\na part is sought exhaustively"),
        "N", kSearchGroup);
    describe(command.add_option("--time-limit", options.time_limit_s,
                                "Give the best pose found in this time, as doubtful; default none"),
             "S", kSearchGroup);
}

}  // namespace raylign::detail::apps
