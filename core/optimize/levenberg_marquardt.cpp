#include "core/optimize/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/base/number_text.h"

namespace raylign::detail {
namespace {

using Rule = LevenbergMarquardtRule;

bool is_finite(const LocalModel& model) {
    return std::isfinite(model.cost) && model.gradient.allFinite() && model.curvature.allFinite();
}

struct Step {
    Eigen::VectorXd step;
    double promised = 0;  ///< by how much the model says that the cost falls
};

Step capped(Eigen::VectorXd step, const LocalModel& model, const Eigen::MatrixXd& curvature, double max_step) {
    const double length = step.norm();
    if (length > max_step) step *= max_step / length;
    const double promised = -(model.gradient.dot(step) + 0.5 * step.dot(curvature * step));
    return {std::move(step), promised};
}

/// The damped step, no longer than max_step. A direction without any curvature stays where it is. `missing`: what the
/// curvature leaves out.
Step damped_step(const LocalModel& model, const Eigen::MatrixXd& missing, double damping, double max_step) {
    const double largest = model.curvature.diagonal().maxCoeff();
    if (!(largest > 0)) return {Eigen::VectorXd::Zero(model.gradient.size()), 0};
    Eigen::MatrixXd damped = model.curvature;
    damped.diagonal() += damping * model.curvature.diagonal().cwiseMax(Rule::least_of_diagonal * largest);
    Eigen::VectorXd plain = -solve_symmetric(damped, model.gradient);
    Eigen::VectorXd learnt = -solve_symmetric(Eigen::MatrixXd(damped + missing), model.gradient);
    // A shorter step would only be slower, and where the two together are hardly positive it says nothing.
    const double share = learnt.norm() / plain.norm();
    if (learnt.dot(model.gradient) < 0 && share > 1 && share < Rule::longest_of_plain) {
        return capped(std::move(learnt), model, model.curvature + missing, max_step);
    }
    return capped(std::move(plain), model, model.curvature, max_step);
}

/// The update of [Dennis81] for what the Gauss-Newton matrix leaves out, sized: after `step` the gradient has changed
/// by `change`.
void learn_missing(Eigen::MatrixXd& missing, const Eigen::MatrixXd& curvature, const Eigen::VectorXd& step,
                   const Eigen::VectorXd& change) {
    const double along = change.dot(step);
    if (!(along > 0)) return;
    const Eigen::VectorXd unexplained = change - curvature * step;
    const double known = step.dot(missing * step), seen = step.dot(unexplained);
    if (std::abs(known) > std::abs(seen)) missing *= std::abs(seen / known);
    const Eigen::VectorXd rest = unexplained - missing * step;
    missing += (rest * change.transpose() + change * rest.transpose()) / along -
               rest.dot(step) / (along * along) * change * change.transpose();
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
    missing_ = Eigen::MatrixXd::Zero(result_.model.curvature.rows(), result_.model.curvature.cols());
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
    auto [step, promised] = damped_step(result_.model, missing_, damping_, options_.max_step);
    step_ = std::move(step);
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
        if (options_.learns) learn_missing(missing_, trial.curvature, step_, trial.gradient - result_.model.gradient);
        result_.model = std::move(trial);
        ++result_.iterations;
        last_length_ = step_.norm();
        damping_ = std::max(damping_ * Rule::damping_down, Rule::least_damping);
    } else {
        damping_ = std::max(damping_ * Rule::damping_up, Rule::least_damping_up);
    }
    if (damping_ > Rule::largest_damping) {
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
