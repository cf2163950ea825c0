#include "core/optimize/levenberg_marquardt.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace raylign {
namespace {

constexpr double kDampingDown = 0.2, kDampingUp = 8;
constexpr double kLargestDamping = 1e8;  // steps are then shorter than any tolerance in use

bool is_finite(const LocalModel& model) {
    return std::isfinite(model.cost) && model.gradient.allFinite() && model.curvature.allFinite();
}

/// The damped step, no longer than max_step. A direction without any curvature stays where it is.
Eigen::VectorXd damped_step(const LocalModel& model, double damping, double max_step) {
    const double largest = model.curvature.diagonal().maxCoeff();
    if (!(largest > 0)) return Eigen::VectorXd::Zero(model.gradient.size());
    Eigen::MatrixXd damped = model.curvature;
    damped.diagonal() += damping * model.curvature.diagonal().cwiseMax(1e-9 * largest);
    Eigen::VectorXd step = -damped.ldlt().solve(model.gradient);
    const double length = step.norm();
    if (length > max_step) step *= max_step / length;
    return step;
}

}  // namespace

std::string LevenbergMarquardtOptions::problem() const {
    if (!(max_step > 0)) return "max_step = " + std::to_string(max_step) + ": must be positive";
    if (!(step_tolerance > 0)) return "step_tolerance = " + std::to_string(step_tolerance) + ": must be positive";
    if (!(initial_damping > 0)) return "initial_damping = " + std::to_string(initial_damping) + ": must be positive";
    if (max_iterations < 1 || max_iterations > 10000) {
        return "max_iterations = " + std::to_string(max_iterations) + ": must be in [1, 10000]";
    }
    return {};
}

LevenbergMarquardtResult levenberg_marquardt(const ManifoldProblem& problem, const LevenbergMarquardtOptions& options,
                                             const StepCallback& on_step) {
    if (const std::string fault = options.problem(); !fault.empty()) throw Error(fault);
    LevenbergMarquardtResult result;
    result.model = problem.linearize(Eigen::VectorXd::Zero(problem.dimension));
    result.linearizations = 1;
    const auto end = [&](Termination termination) {
        result.termination = termination;
        return result;
    };
    if (!is_finite(result.model)) return end(Termination::non_finite_cost);

    double damping = options.initial_damping;
    while (result.linearizations <= options.max_iterations) {
        const Eigen::VectorXd step = damped_step(result.model, damping, options.max_step);
        const double length = step.norm();
        if (!(length >= options.step_tolerance)) return end(Termination::converged);
        LocalModel trial = problem.linearize(step);
        ++result.linearizations;
        if (!is_finite(trial)) return end(Termination::non_finite_cost);
        if (!(trial.cost < result.model.cost)) {
            damping *= kDampingUp;
            if (damping > kLargestDamping) return end(Termination::converged);
            continue;
        }
        problem.accept(step);
        result.model = std::move(trial);
        ++result.iterations;
        damping = std::max(damping * kDampingDown, 1e-9);
        if (on_step && !on_step({result.iterations, result.model.cost, length})) return end(Termination::stopped);
    }
    return end(Termination::max_iterations);
}

}  // namespace raylign
