#include "core/optimize/bobyqa.h"

#include <nlopt.h>

#include <cmath>
#include <exception>
#include <limits>
#include <memory>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace raylign::detail {
namespace {

struct Run {
    const BatchObjective& objective;
    const SteepestDescentCallback& on_step;
    nlopt_opt solver;
    BobyqaResult result;
    std::exception_ptr thrown;  // C code lies between us and the caller: nothing may be thrown through it

    double evaluate(const Eigen::VectorXd& point) {
        double cost = 0;
        objective({&point, 1}, {&cost, 1});
        if (!std::isfinite(cost)) {
            result.termination = Termination::non_finite_cost;
            nlopt_force_stop(solver);
        } else if (!std::isfinite(result.cost)) {
            result.cost = cost;  // of the start
        } else if (cost < result.cost) {
            const double length = (point - result.point).norm();
            result.point = point;
            result.cost = cost;
            ++result.iterations;
            if (on_step && !on_step({result.iterations, cost, length}, point)) {
                result.termination = Termination::stopped;
                nlopt_force_stop(solver);
            }
        }
        return cost;
    }
};

double objective_for_nlopt(unsigned n, const double* x, double* /*gradient*/, void* data) {
    Run& run = *static_cast<Run*>(data);
    try {
        return run.evaluate(Eigen::Map<const Eigen::VectorXd>(x, n));
    } catch (...) {
        run.thrown = std::current_exception();
        nlopt_force_stop(run.solver);
        return std::numeric_limits<double>::infinity();
    }
}

}  // namespace

std::string BobyqaOptions::problem() const {
    if (!(initial_step > 0)) return "initial_step = " + number_text(initial_step) + ": must be positive";
    if (!(step_tolerance > 0)) return "step_tolerance = " + number_text(step_tolerance) + ": must be positive";
    if (max_evaluations < 1 || max_evaluations > 1000000) {
        return "max_evaluations = " + std::to_string(max_evaluations) + ": must be in [1, 1000000]";
    }
    return {};
}

BobyqaResult bobyqa(const BatchObjective& objective, const Eigen::VectorXd& start, const BobyqaOptions& options,
                    const SteepestDescentCallback& on_step) {
    if (const std::string fault = options.problem(); !fault.empty()) throw Error(fault);
    const auto dimension = static_cast<unsigned>(start.size());
    const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> solver(nlopt_create(NLOPT_LN_BOBYQA, dimension),
                                                                   nlopt_destroy);
    Run run{objective, on_step, solver.get(), {start, std::numeric_limits<double>::infinity()}, nullptr};
    nlopt_set_min_objective(solver.get(), objective_for_nlopt, &run);
    nlopt_set_initial_step1(solver.get(), options.initial_step);
    nlopt_set_xtol_abs1(solver.get(), options.step_tolerance);
    nlopt_set_maxeval(solver.get(), options.max_evaluations);
    Eigen::VectorXd point = start;
    double cost = 0;
    const nlopt_result status = nlopt_optimize(solver.get(), point.data(), &cost);
    if (run.thrown) std::rethrow_exception(run.thrown);
    if (status == NLOPT_MAXEVAL_REACHED) run.result.termination = Termination::max_iterations;
    if (status == NLOPT_INVALID_ARGS || status == NLOPT_OUT_OF_MEMORY || status == NLOPT_FAILURE) {
        throw Error(std::string("bobyqa: NLopt failed: ") + nlopt_result_to_string(status));
    }
    return run.result;
}

}  // namespace raylign::detail
