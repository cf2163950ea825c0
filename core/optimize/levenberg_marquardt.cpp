#include "core/optimize/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"

namespace raylign::detail {
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
    Eigen::VectorXd step = -solve_symmetric(damped, model.gradient);
    const double length = step.norm();
    if (length > max_step) step *= max_step / length;
    return step;
}

}  // namespace

std::string LevenbergMarquardtOptions::problem() const {
    if (!(max_step > 0)) return "max_step = " + number_text(max_step) + ": must be positive";
    if (!(step_tolerance > 0)) return "step_tolerance = " + number_text(step_tolerance) + ": must be positive";
    if (!(decrease_tolerance >= 0)) {
        return "decrease_tolerance = " + number_text(decrease_tolerance) + ": must not be negative";
    }
    if (!(initial_damping > 0)) return "initial_damping = " + number_text(initial_damping) + ": must be positive";
    if (max_iterations < 1 || max_iterations > 10000) {
        return "max_iterations = " + std::to_string(max_iterations) + ": must be in [1, 10000]";
    }
    return {};
}

LevenbergMarquardtSearch::LevenbergMarquardtSearch(LocalModel model, const LevenbergMarquardtOptions& options)
    : options_(options), damping_(options.initial_damping) {
    if (const std::string fault = options.problem(); !fault.empty()) throw Error(fault);
    result_.model = std::move(model);
    result_.linearizations = 1;
    if (is_finite(result_.model)) {
        propose();
    } else {
        finish(Termination::non_finite_cost);
    }
}

void LevenbergMarquardtSearch::finish(Termination termination) {
    done_ = true;
    result_.termination = termination;
}

void LevenbergMarquardtSearch::propose() {
    if (result_.linearizations > options_.max_iterations) return finish(Termination::max_iterations);
    step_ = damped_step(result_.model, damping_, options_.max_step);
    const double promised = -(result_.model.gradient.dot(step_) + 0.5 * step_.dot(result_.model.curvature * step_));
    if (!(step_.norm() >= options_.step_tolerance) || promised < options_.decrease_tolerance) {
        finish(Termination::converged);
    }
}

bool LevenbergMarquardtSearch::take(LocalModel trial) {
    ++result_.linearizations;
    if (!is_finite(trial)) {
        finish(Termination::non_finite_cost);
        return false;
    }
    const bool accepted = trial.cost < result_.model.cost;
    if (accepted) {
        result_.model = std::move(trial);
        ++result_.iterations;
        last_length_ = step_.norm();
        damping_ = std::max(damping_ * kDampingDown, 1e-9);
    } else {
        damping_ *= kDampingUp;
    }
    if (damping_ > kLargestDamping) {
        finish(Termination::converged);
    } else {
        propose();
    }
    return accepted;
}

LevenbergMarquardtResult levenberg_marquardt(const ManifoldProblem& problem, const LevenbergMarquardtOptions& options,
                                             const StepCallback& on_step) {
    LevenbergMarquardtSearch search(problem.linearize(Eigen::VectorXd::Zero(problem.dimension)), options);
    while (!search.done()) {
        const Eigen::VectorXd step = search.step();
        if (!search.take(problem.linearize(step))) continue;
        problem.accept(step);
        const LevenbergMarquardtResult& now = search.result();
        if (on_step && !on_step({now.iterations, now.model.cost, search.last_length()})) {
            search.stop(Termination::stopped);
        }
    }
    return search.result();
}

}  // namespace raylign::detail
